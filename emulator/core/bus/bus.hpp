#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/bus/agenda.hpp"
#include "emulator/core/bus/conditions.hpp"
#include "emulator/core/bus_config.hpp"
#include "emulator/core/bus_stats.hpp"
#include "emulator/core/faults/fault_board.hpp"
#include "emulator/core/faults/link_faults.hpp"
#include "emulator/core/node/motors.hpp"
#include "emulator/core/node/node.hpp"
#include "emulator/core/servo/signals.hpp"
#include "emulator/core/sim_time.hpp"
#include "emulator/core/wire/can_errors.hpp"
#include "emulator/core/wire/host_adapter.hpp"
#include "emulator/core/wire/wire.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {

/// Supply, ambient and load of a drive as last set, without faults.
struct DriveConditions {
  bool power = true;
  double supply_V = 0;
  double ambient_C = 0;
  model::LoadParams load;
};

/// One bus, CAN or RS-485, with its drives: a pure function of configuration, seed and timed
/// frames. Splitting `advance_to` at other instants gives the same replies, byte for byte.
/// Copyable.
///
/// Invalid frames are counted and dropped. Invalid calls throw without effect: std::out_of_range if
/// a drive is not on the bus, std::invalid_argument if a fault is impossible (fault_problem).
/// what() is one line.
class Bus {
 public:
  /// Throws also if the IDs of drives do not ascend, or if an event is invalid.
  explicit Bus(const BusConfig& config);

  /// A host puts `in.frame` on its interface at `in.at`, or now if that is past. Advances time to
  /// `at` only if the send queue of hosts is full, or if hosts have an adapter.
  void receive(const TimedFrame& in);
  /// The send queue of hosts has no room for a frame.
  bool host_queue_full() const { return wire_.host_queue_full(); }
  /// Frames of hosts that wait for the wire, without those in the hosts' adapter.
  std::size_t host_frames_ready() const { return wire_.host_frames_ready(time_); }
  /// End of the last stalled write of a host.
  SimTime hosts_stalled_until() const { return adapter_.stalled_until(); }
  /// A fault keeps replies in the drives.
  bool replies_are_held() const {
    return faults_.any(&FaultRow::blocks) || faults_.any(&FaultRow::holds_back);
  }
  /// No host sends, and no drive has a pending reply.
  bool line_is_quiet() const { return wire_.host_queue_size() == 0 && wire_.drive_frames() == 0; }
  /// Hosts read back what they send.
  bool echoes() const { return faults_.echo() != nullptr; }
  /// Hosts have an adapter, or had one: `receive` advances time to the frame.
  bool adapted() const { return faults_.any_of_adapter() || adapter_.in_use(); }
  /// Advances up to and including `until`, never backwards. Returns false only if shared motors
  /// have not reached `waits_for()`: call again with the same time when they have. `deliver_to` and
  /// `settle` return the same.
  bool advance_to(SimTime until);
  /// Executes all events before `t` and advances the motors to `t`; events at `t` remain pending.
  /// Returns as `advance_to`.
  bool reach(SimTime t);
  /// As `advance_to`, for callers that wait for replies: motors without influence on the wire may
  /// lag until `settle` or `advance_to`. No drive may be read before that.
  bool deliver_to(SimTime until);
  /// Advances lagging motors to `time()`. Every action on the bus calls it first.
  bool settle();
  /// Appends the frames that hosts have received since the last call, in order: frames of drives,
  /// and of hosts with a `sender`.
  void take_replies(std::vector<TimedFrame>& out);
  /// Appends the ROM writes of drives since the last call, in order.
  void take_rom_writes(std::vector<RomWrite>& out);
  /// The last write taken from the drive `id` could not be stored: restores its ROM to these
  /// values. A later pending write contains that change and keeps it.
  void restore_rom(int id, const Registers& rom, const RomWear& wear);
  /// Writes the setting `parameter` of `value` at the drive, not over the wire: to RAM now, to ROM
  /// when the flash is done. Returns false without effect if the drive is dead or too many writes
  /// are pending.
  bool write_setting(int id, RomParameter parameter, const Registers& value);
  /// Executes or starts the directive now. Returns false without effect if it is a fault and
  /// `faults_full()`.
  bool apply(const Directive& directive);
  /// Schedules a directive for its time or condition; a fault is armed now. Samples conditions
  /// every kSamplePeriod, but counts frames at once. Returns false without effect if there is no
  /// room for the fault or the condition.
  bool plan(const TimedDirective& planned);
  /// As `plan`, but behaves like the last event of the configuration. Pre: its time is not past.
  bool plan_as_configured(const TimedDirective& event);
  static constexpr SimTime kSamplePeriod = std::chrono::milliseconds(1);
  /// Faults on the board, in the order of arming: all unfinished ones, at most kMaxFaults in
  /// total.
  std::vector<FaultReport> faults() const { return faults_.reports(); }
  /// Limit of faults on the board, finished ones included.
  static constexpr std::size_t kMaxFaults = FaultBoard::kMax;
  /// Limit of pending conditions.
  static constexpr std::size_t kMaxWaiting = Conditions::kMax;
  /// Pending directives, faults aside, that wait for a condition.
  std::size_t unmet_directives() const { return conditions_.directives(); }
  /// Pending directives, faults aside, that wait for their time.
  std::size_t planned_directives() const { return agenda_.directives(); }
  bool faults_full() const { return faults_.full(); }
  /// Number of faults armed so far, and of those that are not over.
  std::size_t faults_armed() const { return faults_.armed(); }
  std::size_t unfinished_faults() const { return faults_.unfinished(); }
  /// Time of the next frame, reply or event; ticks of motors do not count.
  std::optional<SimTime> next_due() const;
  SimTime time() const { return time_; }
  /// Used by `SharedMotors`.
  Motors& motors() { return motors_; }
  SimTime waits_for() const { return waits_for_; }

  /// Number of drives.
  std::size_t size() const { return nodes_.size(); }
  /// No motor lags behind `time()`.
  bool settled() const { return motors_at_ == time_; }
  BusStats stats() const;  // pre: settled(); also below, unless "at any time"

  bool has(int id) const { return nodes_.has(id); }
  /// The drive `id` answers multi-drive commands only. At any time.
  bool multi_drive_mode(int id) const { return nodes_.of(id).servo.multi_drive_mode(); }
  /// Address, bus and rates in force of the drive `id`. At any time.
  const DriveAddress& bus_address(int id) const { return nodes_.of(id).servo.bus_address; }
  /// Changes whenever the address of some drive changes.
  std::uint64_t address_changes() const { return nodes_.address_changes(); }
  // For the drive `id`.
  const Servo& servo(int id) const {
    assert(settled());
    return nodes_.of(id).servo;
  }
  model::Telemetry telemetry(int id) const;
  model::Truth truth(int id) const;
  DriveConditions drive_conditions(int id) const;
  /// Set point of the control loops.
  model::Setpoint setpoint(int id) const;
  DriveView view(int id) const {
    return {servo(id), telemetry(id), truth(id), nodes_.of(id).joint, &body_};
  }
  /// State of the body that drives of the bus move. At any time.
  const BodyState& body() const { return body_; }
  /// Appends the acts on the body since the last call, in order.
  void take_body_acts(std::vector<BodyAct>& out);
  /// Energy taken from the source since power-up.
  double drawn_J(int id) const;
  /// Pre: the drive is mounted on a body.
  model::MountedShaft mounted_shaft(int id) const;
  // Effective at once.
  void set_supply_drop(int id, double drop_V) { lane(nodes_.of(id)).set_supply_drop(drop_V); }
  /// Sets the state of the drive's joint in the body.
  void mount(int id, const model::Mount& mount, const JointState& joint);
  void set_body(const BodyState& body) { body_ = body; }
  void set_load(int id, const model::LoadParams& load);
  void set_supply_voltage(int id, double supply_V);
  void set_ambient_temperature(int id, double ambient_C);
  /// Restarts the controller at once. As after a power loss, pending replies and ROM writes are
  /// lost. No effect on a dead one.
  void power_cycle(int id);

 private:
  Lane lane(const Node& node) { return motors_.lane(node.motor); }
  /// Throws if no bus with these drives can execute it.
  void check(const Directive& directive) const;
  bool schedule(const TimedDirective& planned, Agenda::Rank rank);
  enum class Advance : std::uint8_t {
    kReached,
    kPowerEdge,  // at the first earlier instant at which a drive dies or starts
    kWaiting,    // shared motors have not arrived
  };
  /// Advances all motors to `t`, or only `one` and those that are computed with it.
  Advance advance_motors_to(SimTime t, const Node* one = nullptr);
  Advance await_shared_motors(SimTime t);
  /// As `advance_motors_to`, for the drives that the events due by `t` affect.
  Advance advance_affected_motors_to(SimTime t);
  /// Some fault or condition may read any drive.
  bool faults_or_conditions() const { return faults_.any_active() || !conditions_.empty(); }
  void update_power();
  /// `at`: last instant with power.
  void lose_power(Node& node, SimTime at);

  void perform(const Task& task);
  void step_supply(Node& node);
  void begin_fault(std::size_t fault);
  void update_line_hold();
  void end_fault(std::size_t fault);
  /// Updates motor, link and firmware of a drive for its active faults.
  void apply_faults(Node& node);
  void sample();
  void sample_faults();
  void sample_fault(LiveFault& live);

  void deliver_next();
  bool line_is_held();
  void echo(SimTime at);
  /// Passes a frame from the wire to the hosts, through their adapter.
  void to_host(TimedFrame frame);
  void bytes_to_host(TimedFrame frame);
  void count_adapter_overrun();
  void deliver_to_host(const TimedFrame& frame);
  /// Pre: the motor of the drive is at `time_`. Restarts its controller.
  void restart(Node& node);
  /// The firmware has started, perhaps at another address.
  void on_controller_start(Node& node);
  /// The ID, bus or rate in force has changed.
  void on_address_change(Node& node);
  /// The state of one drive may decide what the others receive.
  bool any_affects_others() const;
  /// A half of 0x18 is over.
  void step_calibration(Node& node);
  void process_query(SimTime at, const protocol::Frame& frame);
  void process_multi_drive(SimTime at, const protocol::Frame& frame);
  /// A drive receives a frame addressed to it. Returns why it does not answer; nullopt if it does.
  std::optional<Drop> process_for_drive(SimTime at, Node& node, const protocol::Frame& frame);
  /// Addressees of a query.
  enum class Addressees : std::uint8_t { kOne, kSeveral };
  void answer(SimTime at, Node& node, const protocol::Query& query, Addressees whom);
  /// State before a command.
  struct PriorState {
    bool mute;                 // nothing that the drive sends leaves it
    std::uint64_t rom_writes;  // number of ROM writes so far
  };
  /// Sends the reply at `ready`, or later when the flash is done.
  void send_reply(SimTime at, SimTime ready, Node& node, const protocol::Reply& reply,
                  PriorState before);
  /// Delay from the last bit of a query to the reply.
  SimTime reply_time(Node& node, Addressees whom) const;
  void deliver(const WireDelivery& delivery);
  /// A drive at another bit rate answers each frame with an error flag, until it is error-passive.
  bool is_disturbed();
  /// Lets a fault destroy the CAN frame that is due (RS-485: spoil it). Returns true if destroyed.
  bool destroy_next();
  /// The sending controller gives the frame up at bus-off.
  void leave_bus(const WireCandidate& given_up);
  /// Transmit error counter of the sender of this frame.
  int& transmit_errors(const WireCandidate& frame);

  SimTime time_{0};
  SimTime motors_at_{0};  // the least time of all motors
  SimTime waits_for_{0};  // time that shared motors have to reach
  Wire wire_;
  std::optional<SerialConfig> serial_;
  std::uint64_t seed_;
  Motors motors_;
  Nodes nodes_;
  HostErrorCounters host_errors_;
  AdapterTimes own_adapter_;  // as configured, without faults
  HostAdapter adapter_;
  bool had_errors_ = false;  // a frame has been destroyed: error counters may be above 0
  int flags_left_ = 0;       // sum over all nodes
  Agenda agenda_;
  Conditions conditions_;
  FaultBoard faults_;
  Duplicates duplicates_;
  std::vector<TimedFrame> replies_;   // received by hosts, not yet taken
  std::vector<RomWrite> rom_writes_;  // not yet taken
  std::vector<BodyAct> body_acts_;    // not yet taken
  BodyState body_;
  std::shared_ptr<const BodySignals> body_signals_;  // for conditions on them
  BusStats stats_;                                   // without the sums over drives, see stats()
};

}  // namespace lk::emulator
