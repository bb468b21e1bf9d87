#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "emulator/core/bus/bus_state.hpp"
#include "emulator/core/bus/bus_steps.hpp"

namespace lk::emulator {

/// One bus, CAN or RS-485, with its drives. The results depend only on configuration, seed and
/// timed frames: calls of `advance_to` at other instants give the same replies, byte for byte.
/// Copies are independent.
///
/// Invalid frames are counted and dropped. Invalid calls throw without effect: std::out_of_range if
/// a drive is not on the bus, std::invalid_argument if a fault is impossible (fault_problem).
/// what() is one line.
class Bus {
 public:
  /// Throws if the IDs of drives do not ascend, or if an event is invalid.
  explicit Bus(const BusConfig& config) : state_(config) {}

  /// Full state of the bus. Only Coupling and Battery change it from outside, through functions of
  /// BusState and its member `body`, and SharedMotors, which takes over `motors`.
  const BusState& state() const { return state_; }
  BusState& state() { return state_; }

  /// A host puts `in.frame` on its interface at `in.at`, or now if that is past. Advances time to
  /// `at` only if the send queue of hosts is full, or if hosts have an adapter. Returns false if
  /// the host's write fails, because the queue is full (QueueFull::kRefuse).
  bool receive(const TimedFrame& in) { return emulator::receive(state_, in); }
  /// Advances up to and including `until`, never backwards. Returns false only if shared motors
  /// have not reached `state().waits_for`: call again with the same time when they have reached it.
  /// `reach`, `deliver_to` and `settle` return false in the same case.
  bool advance_to(SimTime until) { return emulator::advance_to(state_, until); }
  /// Executes all events before `t` and advances the motors to `t`; events at `t` remain pending.
  bool reach(SimTime t) { return emulator::reach(state_, t); }
  /// As `advance_to`, for callers that wait for replies: motors without influence on the wire may
  /// lag until `settle` or `advance_to`. No drive may be read before that.
  bool deliver_to(SimTime until) { return emulator::deliver_to(state_, until); }
  /// Advances lagging motors to `time()`. Every action on the bus calls it first.
  bool settle() { return emulator::settle(state_); }
  /// Time of the next frame, reply or event; ticks of motors do not count.
  std::optional<SimTime> next_due() const { return emulator::next_due(state_); }
  SimTime time() const { return state_.time; }

  // Each of these functions appends the items since its last call to `out`, in order.
  /// Frames that hosts have received: from drives, and from hosts that have a `sender` number.
  void take_replies(std::vector<TimedFrame>& out);
  /// ROM writes of drives.
  void take_rom_writes(std::vector<RomWrite>& out);
  /// Actions on the body that directives requested.
  void take_body_acts(std::vector<BodyAct>& out);

  /// Call if the last ROM write taken of the drive `id` could not be stored. Restores its ROM to
  /// these values. A later ROM write, if any, also contains the change, and keeps it.
  void restore_rom(int id, const Registers& rom, const RomWear& wear) {
    emulator::restore_rom(state_, id, rom, wear);
  }
  /// Writes the setting `parameter` of `value` at the drive, not over the wire: to RAM now, to ROM
  /// when the flash is done. Returns false without effect if the drive is dead or too many writes
  /// are pending.
  bool write_setting(int id, RomParameter parameter, const Registers& value) {
    return emulator::write_setting(state_, id, parameter, value);
  }
  /// Executes or starts the directive now. Returns false without effect if it is a fault and the
  /// board is full.
  bool apply(const Directive& directive) { return emulator::apply(state_, directive); }
  /// Schedules a directive for its time or condition; a fault is armed now. A condition is sampled
  /// every kSamplePeriod, but CommandSeen acts at the frame. Returns false without effect if the
  /// fault or the condition exceeds the limit.
  bool plan(const TimedDirective& planned) { return emulator::plan(state_, planned); }
  /// As `plan`, but as if `event` were the last event of the configuration. Pre: its time is not
  /// past.
  bool plan_as_configured(const TimedDirective& event) {
    return emulator::plan_as_configured(state_, event);
  }
  /// Faults on the board, in the order of arming: all unfinished ones, at most kMaxFaults in
  /// total.
  std::vector<FaultReport> faults() const { return state_.faults.reports(); }
  /// Limit of faults on the board, finished ones included.
  static constexpr std::size_t kMaxFaults = FaultBoard::kMax;
  /// Limit of pending conditions.
  static constexpr std::size_t kMaxWaiting = Conditions::kMax;

  /// Number of drives.
  std::size_t size() const { return state_.nodes.size(); }
  bool has(int id) const { return state_.nodes.has(id); }
  /// Address, bus and bit rates in force of the drive `id`. Motors may lag.
  const DriveAddress& bus_address(int id) const { return state_.nodes.of(id).servo.bus_address; }
  // State of the drive `id`, as in BusState. Pre: no motor lags.
  const Servo& servo(int id) const { return state_.servo(id); }
  model::Telemetry telemetry(int id) const { return state_.telemetry(id); }
  model::Truth truth(int id) const { return state_.truth(id); }
  DriveView view(int id) const { return state_.view(id); }
  BusStats stats() const { return state_.stats(); }

  // Shorthands for `apply`.
  void set_load(int id, const model::LoadParams& load) { apply({id, Load{load}}); }
  void set_supply_voltage(int id, double supply_V) {
    apply({id, SupplyVoltage{supply_V, SimTime{0}}});
  }
  /// Restarts the controller at once. As after a power loss, pending replies and ROM writes are
  /// lost. No effect if the controller is dead.
  void power_cycle(int id) { emulator::power_cycle(state_, id); }

 private:
  BusState state_;
};

}  // namespace lk::emulator
