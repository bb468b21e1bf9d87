#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/bus/host_adapter.hpp"
#include "emulator/core/bus/link.hpp"
#include "emulator/core/faults/acts.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/servo/servo.hpp"
#include "model/faults.hpp"

namespace lk::emulator {

/// Faults of a bus, armed, active or over, and their effects. The key of a fault is its order: the
/// number of faults armed before it. Copies are independent.
class FaultBoard {
 public:
  /// Capacity, including faults that are over. If the board holds so many, arming another fault
  /// drops the oldest one that is over.
  static constexpr std::size_t kMax = 1000;
  /// Approximate limit of samples per call of `take_due_samples`; a lasting plant fault takes one
  /// sample per drive. Above the limit, faults take turns.
  static constexpr std::size_t kMaxSamples = 256;
  explicit FaultBoard(std::uint64_t bus_seed) : bus_seed_(bus_seed) {}

  std::uint64_t bus_seed() const { return bus_seed_; }
  /// No fault can be armed: kMax are kept, and none is over.
  bool full() const { return faults_.size() >= kMax && !oldest_over(); }
  /// Number of faults armed so far.
  std::size_t armed() const { return armed_; }
  /// Number of faults that are not over.
  std::size_t unfinished() const;
  bool any_active() const { return active_ > 0; }
  /// Some fault so far, over or not, acts on the hosts' adapter.
  bool any_of_adapter() const { return any_of_adapter_; }
  /// Pre: the fault has not been dropped.
  LiveFault& operator[](std::size_t order) { return faults_[*index_of(order)]; }
  const LiveFault& operator[](std::size_t order) const { return faults_[*index_of(order)]; }
  auto begin() { return faults_.begin(); }
  auto end() { return faults_.end(); }
  auto begin() const { return faults_.begin(); }
  auto end() const { return faults_.end(); }
  /// Returns all faults on the board, in the order of arming.
  std::vector<FaultReport> reports() const;

  /// Pre: `!full()`. Arms a fault under a unique name. Returns its order.
  std::size_t arm(Fault fault, SimTime now);
  /// Begins an occurrence of a fault. Returns false if the fault was cleared or dropped before.
  bool start(std::size_t order, SimTime now);
  void stop(std::size_t order);
  /// Returns the faults that are not over and have this name or kind; "all" returns all of them.
  std::vector<std::size_t> find(const std::string& which) const;

  /// Returns the plant faults to sample now, and marks them as sampled: new ones at once, others in
  /// turns of kMaxSamples.
  std::vector<std::size_t> take_due_samples(SimTime now);
  /// As `take_due_samples`, for one fault out of turn. Returns true if the caller must sample it.
  bool mark_sampled(std::size_t order, SimTime now);

  /// Returns the first active fault of the drive `id` (kWholeBus: of any drive) whose row has
  /// `trait`; null if there is none.
  LiveFault* first(int id, bool FaultRow::*trait);
  /// Some active fault has a row with `trait`.
  bool any(bool FaultRow::*trait) const;

 private:
  std::string free_name(const Fault& fault) const;
  // These return an index in `faults_`; nullopt if the fault is not there.
  std::optional<std::size_t> index_of(std::size_t order) const;
  std::optional<std::size_t> oldest_over() const;
  bool mark_sampled(LiveFault& live, SimTime now);

  std::uint64_t bus_seed_;
  std::vector<LiveFault> faults_;  // by order
  std::size_t armed_ = 0;
  std::size_t active_ = 0;
  bool any_of_adapter_ = false;
  std::size_t turn_ = 0;  // index of the next fault to sample
};

// Effects of active faults.

/// Calls `act` with each active fault that has a function or flag in this column of the table, in
/// the order of arming. `id`: only faults of this drive; kWholeBus: all.
template <class Board, class Value, class Act>
void each_active(Board& faults, Value FaultRow::*column, int id, Act act) {
  if (!faults.any_active()) return;
  for (auto& live : faults) {
    if (live.active() && live.row().*column != Value{} && (id == kWholeBus || live.is_of(id)))
      act(live);
  }
}
model::Faults plant_faults(const FaultBoard& faults, const ServoConfig& servo, SimTime now);
FirmwareFaults firmware_faults(const FaultBoard& faults, int id);
/// Returns `sum` plus the times of active faults of the adapter.
AdapterTimes adapter_times(const FaultBoard& faults, AdapterTimes sum);
/// Counts an effect for each adapter fault that acted on the frame, as `shown`.
void count_adapter(FaultBoard& faults, const AdapterEffects& shown, const protocol::Frame& frame,
                   SimTime now);
/// Counts an effect for each firmware fault that changed the servo's behaviour since the last call.
void count_firmware_effects(FaultBoard& faults, Servo& servo, SimTime now);
/// Applies faults to a frame before the drive receives it; may change it. Returns false if the
/// drive does not receive it.
bool apply_to_query(FaultBoard& faults, const DriveLink& link, const Servo& servo,
                    protocol::Frame& frame, SimTime now);
/// Counts an effect for the fault that blocks the drive's send queue: a full queue made the drive
/// ignore this query.
void count_ignored(FaultBoard& faults, int id, const protocol::Frame& query, SimTime now);
/// A reply after the faults have acted on it.
struct FaultedReply {
  std::vector<Outgoing> out;
  std::uint64_t lost = 0, extra = 0;  // frames that do not leave; additional frames
  bool stale = false;                 // repeats an earlier reply
};
FaultedReply apply_to_reply(FaultBoard& faults, int id, const DriveLink& link,
                            const Outgoing& reply, std::int64_t bitrate, SimTime now);
/// Returns the fault that destroys a frame on the wire; null if none does. `sender`: the drive that
/// sends the frame; kWholeBus: a host or a duplicate.
LiveFault* destroyer(FaultBoard& faults, int sender, std::int64_t bitrate, bool serial);
/// Worst cut of the hosts' connection.
HostCut host_cut(const FaultBoard& faults);
/// Applies faults to a frame that the host reads on RS-485.
void apply_to_read(FaultBoard& faults, protocol::Frame& frame, SimTime now);
/// Fault that holds the line longest after frames of hosts; null if none does.
LiveFault* line_holder(FaultBoard& faults);
/// Extra time that the drive stays off the bus after a bus-off.
SimTime recovery(const FaultBoard& faults, int id);

/// Returns the effect of this fault alone on the motor of the drive `servo`.
model::Faults plant_faults(const LiveFault& live, const ServoConfig& servo, SimTime now);

}  // namespace lk::emulator
