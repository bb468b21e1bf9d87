#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/faults/live_fault.hpp"
#include "emulator/core/node/link.hpp"
#include "emulator/core/servo/servo.hpp"
#include "emulator/core/wire/host_adapter.hpp"
#include "model/faults.hpp"

namespace lk::emulator {

/// The faults of a bus: armed, active, over, and what has shown of them. Each is known by its
/// order, which is how many were armed before it. A value.
class FaultBoard {
 public:
  /// Faults that a bus keeps, with those that are over. For each more, the oldest that is over is
  /// dropped.
  static constexpr std::size_t kMost = 1000;
  /// Lasting faults of the plant, each at each of its drives, are looked at in one step, about so
  /// many; of more, each has its turn.
  static constexpr std::size_t kMostLooks = 256;
  explicit FaultBoard(std::uint64_t bus_seed) : bus_seed_(bus_seed) {}

  std::uint64_t bus_seed() const { return bus_seed_; }
  /// No fault can be armed: kMost are kept, and none of them is over.
  bool full() const { return faults_.size() >= kMost && !oldest_over(); }
  /// All there have been.
  std::size_t armed() const { return armed_; }
  /// Those that are not over.
  std::size_t unfinished() const;
  bool any_active() const { return active_ > 0; }
  /// Some fault, over or not, is of the hosts' adapter.
  bool any_of_adapter() const { return any_of_adapter_; }
  /// One that has not been dropped.
  LiveFault& operator[](std::size_t order) { return faults_[*place(order)]; }
  const LiveFault& operator[](std::size_t order) const { return faults_[*place(order)]; }
  auto begin() { return faults_.begin(); }
  auto end() { return faults_.end(); }
  /// In the order in which they were armed.
  std::vector<FaultReport> reports() const;

  /// The board must not be full. Gives the fault a name that no kept one has. Returns its order.
  std::size_t arm(Fault fault, SimTime now);
  /// Returns false when it has been cleared or dropped before.
  bool start(std::size_t order, SimTime now);
  void stop(std::size_t order);
  /// Those that are not over and have this name, are of this kind, or all of them: "all".
  std::vector<std::size_t> find(const std::string& which) const;

  /// Which faults of the plant are to be looked at now: what is new at once, of the others as many
  /// as one step is to take. Each counts as looked at.
  std::vector<std::size_t> take_turns(SimTime now);
  /// The same for this one, whether it is its turn or not.
  bool take_turn(std::size_t order, SimTime now);

  // What active faults do to one drive.

  /// The first whose row says `trait`; null when the drive has none.
  LiveFault* first(int id, bool FaultRow::*trait);
  /// Some active fault has a row that says `trait`.
  bool any(bool FaultRow::*trait) const;
  model::Faults plant_faults(const ServoConfig& servo, SimTime now) const;
  FirmwareFaults firmware_faults(int id) const;
  /// What the active ones make of the hosts' adapter.
  AdapterTimes adapter_times(AdapterTimes sum) const;
  /// Counts what showed of that on a frame.
  void count_adapter(const AdapterShown& shown, const protocol::Frame& frame, SimTime now);
  /// Counts what the firmware did because of one.
  void count_shown(Servo& servo, SimTime now);
  /// Returns false when the frame on the wire does not reach the drive; changes it when it reaches
  /// it as another.
  bool hear(const DriveLink& link, const Servo& servo, protocol::Frame& frame, SimTime now);
  /// A query came while the drive's queue was full.
  void count_ignored(int id, const protocol::Frame& query, SimTime now);
  /// What becomes of a reply.
  struct Said {
    std::vector<Outgoing> out;
    std::uint64_t lost = 0, extra = 0;  // frames that do not leave, and that nobody asked for
    bool stale = false;                 // it was said before
  };
  Said say(int id, const DriveLink& link, const Outgoing& reply, std::int64_t bitrate, SimTime now);
  /// The one that destroys the frame that drive `sender`, or kWholeBus, has on the wire; null when
  /// it gets through.
  LiveFault* destroyer(int sender, std::int64_t bitrate, bool serial);
  /// What the host reads in place of the frame, on RS-485.
  void read(protocol::Frame& frame, SimTime now);
  /// The one that lets hosts read what they send; null: they do not.
  LiveFault* echo();
  const LiveFault* echo() const;
  /// The one that keeps the line for hosts, and how long behind what they send; null: none.
  LiveFault* line_keeper();
  /// How much longer than others the drive stays off the bus after a bus-off.
  SimTime recovery(int id) const;

 private:
  std::string free_name(const Fault& fault) const;
  /// Places in `faults_`.
  std::optional<std::size_t> place(std::size_t order) const;
  std::optional<std::size_t> oldest_over() const;
  bool take_turn(LiveFault& live, SimTime now);

  std::uint64_t bus_seed_;
  std::vector<LiveFault> faults_;  // by order
  std::size_t armed_ = 0;
  std::size_t active_ = 0;
  bool any_of_adapter_ = false;
  std::size_t turn_ = 0;  // the place of the one that is looked at next
};

/// What one fault does to the motor of one of its drives.
model::Faults plant_faults(const LiveFault& live, const ServoConfig& servo, SimTime now);

}  // namespace lk::emulator
