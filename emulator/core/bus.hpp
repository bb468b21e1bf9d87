#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "emulator/core/agenda.hpp"
#include "emulator/core/bus_config.hpp"
#include "emulator/core/bus_stats.hpp"
#include "emulator/core/can_wire.hpp"
#include "emulator/core/live_fault.hpp"
#include "emulator/core/node.hpp"
#include "emulator/core/servo.hpp"
#include "emulator/core/signals.hpp"
#include "emulator/core/sim_time.hpp"
#include "model/drive_bank.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {

/// What a drive is connected to, as it was said last; faults come on top.
struct Surroundings {
  bool power = true;
  double supply_V = 0;
  double ambient_C = 0;
  model::LoadParams load;
};

/// One CAN bus with its drives: a pure function of configuration, seed and timed frames.
/// Splitting `advance_to` at other instants gives the same replies, byte for byte. Copyable.
class Bus {
 public:
  explicit Bus(const BusConfig& config);

  /// A host put `in.frame` on its interface at `in.at`. Earlier than `time()` counts as now. Only
  /// when the host's send queue is full does this move time, to `at`, to see whether the wire made
  /// room by then.
  void receive(const TimedFrame& in);
  /// A frame of a host would find no room now.
  bool host_queue_full() const { return wire_.host_queue_full(); }
  /// Everything that happens up to and including `until`; not back in time.
  void advance_to(SimTime until);
  /// The same on the wire: for whoever waits for replies. Motors that these do not depend on may
  /// stay behind until `settle` or the next `advance_to`; before, nothing may be read of drives.
  void deliver_to(SimTime until);
  /// Brings the motors that stayed behind to `time()`. Whatever is done to the bus begins with
  /// this.
  void settle();
  /// Moves out the replies that have left the wire since the last call, in order; appended to
  /// `out`.
  void take_replies(std::vector<TimedFrame>& out);
  /// Moves out what drives have written to their ROM since the last call, in order; appended.
  void take_rom_writes(std::vector<RomWrite>& out);
  /// The last write taken from the drive `id` did not reach what keeps it: its ROM holds this
  /// instead, unless a later write is under way, which brings that one with it.
  void restore_rom(int id, const Registers& rom, const RomWear& wear);
  /// Somebody at the drive `id`, not on the wire, writes the setting `parameter` of `value` to RAM,
  /// now, and to ROM, when the flash is done. Returns false, and does nothing, when the drive is
  /// dead or its flash has too much to do already.
  bool write_setting(int id, RomParameter parameter, const Registers& value);
  /// Done now, or begun now. Its drives must be on the bus. Returns false, and does nothing, when
  /// it is a fault and the bus has kMostFaults already.
  bool apply(const Directive& directive);
  /// Will be done when it is time, or when its condition holds. Conditions are looked at every
  /// kLookStep; that a frame has come is known at once. A fault is armed from now on. Returns
  /// false, and plans nothing, when the bus has no room for another fault or another condition.
  bool plan(const TimedDirective& planned);
  static constexpr SimTime kLookStep = std::chrono::milliseconds(1);
  /// Faults that last, each at each of its drives, are looked at in one step, about so many; of
  /// more, each has its turn.
  static constexpr std::size_t kMostLooks = 256;
  /// All faults there have been on this bus, in the order in which they were armed.
  std::vector<FaultReport> faults() const;
  /// Faults that a bus keeps, with those that are over.
  static constexpr std::size_t kMostFaults = 1000;
  /// Conditions that are waited for at once.
  static constexpr std::size_t kMostWaiting = 1000;
  /// Planned directives, faults aside, whose condition has not held yet.
  std::size_t unmet_directives() const;
  /// Planned directives, faults aside, whose time has not come yet.
  std::size_t planned_directives() const { return agenda_.directives(); }
  bool faults_full() const { return faults_.size() >= kMostFaults; }
  /// When `advance_to` will next have something to do besides turning motors: a frame, a reply, an
  /// event.
  std::optional<SimTime> next_due() const;
  SimTime time() const { return time_; }

  /// The number of drives.
  std::size_t size() const { return nodes_.size(); }
  BusStats stats() const;  // like what follows, of a settled bus

  bool has(int id) const;
  /// Whether the drive `id` answers commands for several drives, and those only. At any time.
  bool multi_drive_mode(int id) const { return nodes_[index_of(id)].servo.multi_drive_mode(); }
  // Of the drive `id`, which must be on the bus.
  const Servo& servo(int id) const {
    assert(settled());
    return nodes_[index_of(id)].servo;
  }
  model::Telemetry telemetry(int id) const;
  model::Truth truth(int id) const;
  Surroundings surroundings(int id) const;
  /// What the loops of the drive obey.
  model::Setpoint setpoint(int id) const;
  DriveView view(int id) const { return {servo(id), telemetry(id), truth(id)}; }
  // Act now.
  void set_load(int id, const model::LoadParams& load);
  void set_supply_voltage(int id, double supply_V);
  void set_ambient_temperature(int id, double ambient_C);
  /// The controller starts anew at once: as without power, what it was about to say or to write is
  /// lost. Nothing happens to a dead one.
  void power_cycle(int id);

 private:
  /// The motors that share a PWM rate.
  struct Bank {
    std::int64_t f_pwm_Hz;
    model::DriveBank drives;
  };
  std::vector<MotorPlace> build_motors(const BusConfig& config);
  std::size_t index_of(int id) const;
  Lane lane(std::size_t index);

  bool settled() const { return motors_at_ == time_; }
  /// All motors to `t`, or to the first instant before at which a drive dies or wakes; true then.
  bool bring_motors_to(SimTime t);
  /// The same of one motor, and those that are computed with it.
  bool bring_motor_to(SimTime t, std::size_t index);
  /// The same of those that what is due by `t` is about.
  bool bring_concerned_to(SimTime t);
  /// They look at drives when they like.
  bool faults_or_conditions() const { return active_faults_ > 0 || !waiting_.empty(); }
  void follow_lives();
  /// `at`: the last instant at which it had power.
  void lose_power(std::size_t index, SimTime at);

  void act(std::size_t index, const PowerOn& power);
  void act(std::size_t index, const PowerOff& power);
  void act(std::size_t index, const PowerCycle& cycle);
  void act(std::size_t index, const SupplyVoltage& supply);
  void act(std::size_t index, const Sag& sag);
  void act(std::size_t index, const AmbientTemperature& ambient);
  void act(std::size_t index, const Load& load);
  void act(std::size_t index, const TurnShaft& turn);
  void act(std::size_t index, const Setting& setting);

  /// A directive that waits for its condition, or the beginning of a fault that does.
  struct Waiting {
    SimTime from;
    Condition when;
    Task task;
    int seen = 0;                                 // frames
    std::optional<double> before = std::nullopt;  // the signal, when it was last looked at
    bool due = false;                             // holds, and is about to be done
  };
  std::size_t arm(Fault fault);
  std::string free_name(const Fault& fault) const;
  void begin_fault(std::size_t fault_index);
  void end_fault(std::size_t fault_index);
  void clear_faults(const std::string& which);
  /// Does at once what a fault of the moment does, to one of its drives.
  void strike(LiveFault& live, std::size_t index);
  /// Returns false when ROM held that already.
  bool damage_rom(std::size_t index, RomParameter parameter);
  /// What the motor, the supply and the firmware of a drive have to know of its faults.
  void pass_on_faults(std::size_t index);
  void look();
  void look_at_faults();
  std::size_t look_at(LiveFault& live);
  void look_again_by(SimTime at);
  /// Looks at it; remembers what it saw.
  bool holds(Waiting& waiting) const;
  void count_command(int id, const protocol::Frame& frame);
  /// The first active fault of this kind that the drive has; null when there is none.
  LiveFault* active_fault(std::size_t index, FaultKind kind);
  void took_effect(LiveFault& live, int id, const protocol::Frame* frame = nullptr);
  /// Books what the drive's firmware did because of a fault.
  void book_firmware(std::size_t index);

  void happen();
  void perform(const Task& task);
  void move_supply(std::size_t index, double to_V, SimTime within);
  void step_supply(std::size_t index);
  void reconnect(std::size_t index);
  /// The servo has written its ROM; gives when the flash will have it.
  SimTime begin_rom_write(std::size_t index, SimTime at);
  void finish_rom_write(std::size_t index);

  void deliver_next();
  void process_query(SimTime at, const protocol::Frame& frame);
  void process_multi_drive(SimTime at, const protocol::Frame& frame);
  /// It does not take in another query: what waits for its flash or the wire has to go first.
  bool busy(std::size_t index) const {
    return wire_.drive_queue_full(nodes_[index].servo.reply_id(),
                                  nodes_[index].link.held_back ? 1 : 0);
  }
  void answer(SimTime at, std::size_t index, const protocol::Query& query);
  /// Every frame that a query brings forth leaves the drive here.
  void say(std::size_t index, SimTime ready, const protocol::Frame& frame, std::uint64_t rom_write);

  // Faults of the link (bus_link.cpp, bus_link_errors.cpp).
  /// Returns false when the frame on the wire does not reach the drive; changes it when it reaches
  /// it as another.
  bool hears(std::size_t index, protocol::Frame& frame);
  bool corrupt_replies(LiveFault& live, std::size_t index, std::vector<Outgoing>& out);
  void delay_words(LiveFault& live, std::size_t index, std::vector<Outgoing>& out);
  void hold_back_words(LiveFault& live, std::size_t index, std::vector<Outgoing>& out);
  void copy_words(LiveFault& live, std::size_t index, std::vector<Outgoing>& out);
  void put_on_wire(std::size_t index, const Outgoing& out);
  void forget_words(std::size_t index, SimTime at);
  void ignored_for_full_queue(std::size_t index, const protocol::Frame& query);
  void babble(const Babble& babble);
  void begin_link_fault(std::size_t fault_index);
  void end_link_fault(std::size_t fault_index);
  void pass_on_link_faults(std::size_t index);
  void add_duplicate(std::size_t fault, std::size_t index);
  void bring_duplicates_to(SimTime t);
  void duplicates_hear(SimTime at, const protocol::Frame& frame);
  void answer_as_duplicate(SimTime at, DuplicateDrive& second, const protocol::Query& query);
  LiveFault* destroyer(const CanWire::Candidate& next);
  int& transmit_errors(const CanWire::Candidate& next);
  bool destroy_next();
  void leave_bus(const CanWire::Candidate& given_up);
  void count_success(const CanWire::Delivery& delivery);

  void drop(Drop cause) { ++stats_.dropped[static_cast<std::size_t>(cause)]; }

  std::int64_t bitrate_;
  SimTime time_{0};
  SimTime motors_at_{0};  // where all of them are at least
  CanWire wire_;
  std::vector<Bank> banks_;
  std::vector<Node> nodes_;  // ascending IDs
  HostLink host_link_;
  std::vector<DuplicateDrive> duplicates_;
  bool had_errors_ = false;  // some frame has been destroyed: error counters may stand above 0
  Agenda agenda_;
  std::uint64_t seed_;
  std::vector<LiveFault> faults_;
  std::size_t active_faults_ = 0;
  std::size_t fault_turn_ = 0;   // which is looked at next
  std::set<std::size_t> moved_;  // drives whose faults are not what they were
  std::vector<Waiting> waiting_;
  std::optional<SimTime> next_look_;
  std::array<std::int8_t, protocol::kMaxId + 1> index_of_id_{};  // −1 = not on the bus
  std::vector<TimedFrame> replies_;                              // left the wire, not yet taken
  std::vector<RomWrite> rom_writes_;                             // not yet taken
  BusStats stats_;  // sums over the drives are made on reading
};

}  // namespace lk::emulator
