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
#include "emulator/core/faults/duplicates.hpp"
#include "emulator/core/faults/fault_board.hpp"
#include "emulator/core/node/motors.hpp"
#include "emulator/core/node/node.hpp"
#include "emulator/core/servo/signals.hpp"
#include "emulator/core/sim_time.hpp"
#include "emulator/core/wire/can_errors.hpp"
#include "emulator/core/wire/host_adapter.hpp"
#include "emulator/core/wire/wire.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {

/// What a drive is connected to, as it was said last; faults come on top.
struct Surroundings {
  bool power = true;
  double supply_V = 0;
  double ambient_C = 0;
  model::LoadParams load;
};

/// One bus, CAN or RS-485, with its drives: a pure function of configuration, seed and timed
/// frames. Splitting `advance_to` at other instants gives the same replies, byte for byte.
/// Copyable.
///
/// Frames are counted and dropped, whatever they are. Calls that no bus can carry out throw and do
/// nothing: std::out_of_range for a drive that is not on the bus, std::invalid_argument for a fault
/// that cannot be (fault_problem); what() is one line.
class Bus {
 public:
  /// Throws also for drives whose IDs do not ascend, and for events that cannot be.
  explicit Bus(const BusConfig& config);

  /// A host put `in.frame` on its interface at `in.at`. Earlier than `time()` counts as now. Only
  /// when the host's send queue is full does this move time, to `at`, to see whether the wire made
  /// room by then; or where hosts have an adapter, to see how that stands.
  void receive(const TimedFrame& in);
  /// A frame of a host would find no room now.
  bool host_queue_full() const { return wire_.host_queue_full(); }
  /// Frames of hosts that wait for the wire and not for the hosts' adapter.
  std::size_t host_frames_ready() const { return wire_.host_frames_ready(time_); }
  /// When the last write that a fault has stalled is over.
  SimTime hosts_stalled_until() const { return adapter_.stalled_until(); }
  /// A fault keeps replies in the drives.
  bool replies_are_held() const {
    return faults_.any(&FaultRow::blocks) || faults_.any(&FaultRow::holds_back);
  }
  /// No host sends, and no drive has a reply to send.
  bool line_is_quiet() const { return wire_.host_queue_size() == 0 && wire_.drive_frames() == 0; }
  /// Hosts read what they send.
  bool echoes() const { return faults_.echo() != nullptr; }
  /// Hosts have an adapter, or had: `receive` moves time to the frame.
  bool adapted() const { return faults_.any_of_adapter() || adapter_.in_use(); }
  /// Everything that happens up to and including `until`; not back in time. Like `deliver_to` and
  /// `settle` it returns true, unless the motors are shared: then false when it has to wait for
  /// them, and is to be called again, with the same time, when they have got to `waits_for`.
  bool advance_to(SimTime until);
  /// Everything before `t` has happened and the motors stand at `t`; what happens at `t` itself is
  /// still to come. Returns as advance_to does.
  bool reach(SimTime t);
  /// The same on the wire: for whoever waits for replies. Motors that these do not depend on may
  /// stay behind until `settle` or the next `advance_to`; before, nothing may be read of drives.
  bool deliver_to(SimTime until);
  /// Brings the motors that stayed behind to `time()`. Whatever is done to the bus begins with
  /// this.
  bool settle();
  /// Moves out what hosts have got since the last call, in order; appended to `out`: frames of
  /// drives, and those of hosts that have a `sender`.
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
  /// Done now, or begun now. Returns false, and does nothing, when it is a fault and the bus has
  /// kMostFaults that are not over.
  bool apply(const Directive& directive);
  /// Will be done when it is time, or when its condition holds. Conditions are looked at every
  /// kLookStep; that a frame has come is known at once. A fault is armed from now on. Returns
  /// false, and plans nothing, when the bus has no room for another fault or another condition.
  bool plan(const TimedDirective& planned);
  /// The same, and all comes about as if it stood last in the configuration. Its time must not be
  /// over.
  bool plan_as_configured(const TimedDirective& event);
  static constexpr SimTime kLookStep = std::chrono::milliseconds(1);
  /// The last kMostFaults on this bus, and all that are not over, in the order in which they were
  /// armed.
  std::vector<FaultReport> faults() const { return faults_.reports(); }
  /// Faults that a bus keeps, with those that are over.
  static constexpr std::size_t kMostFaults = FaultBoard::kMost;
  /// Conditions that are waited for at once.
  static constexpr std::size_t kMostWaiting = Conditions::kMost;
  /// Planned directives, faults aside, whose condition has not held yet.
  std::size_t unmet_directives() const { return conditions_.directives(); }
  /// Planned directives, faults aside, whose time has not come yet.
  std::size_t planned_directives() const { return agenda_.directives(); }
  bool faults_full() const { return faults_.full(); }
  /// How many have been armed; and how many of these are not over.
  std::size_t faults_armed() const { return faults_.armed(); }
  std::size_t unfinished_faults() const { return faults_.unfinished(); }
  /// When `advance_to` will next have something to do besides turning motors: a frame, a reply, an
  /// event.
  std::optional<SimTime> next_due() const;
  SimTime time() const { return time_; }
  /// For whoever computes its motors together with those of other buses (SharedMotors).
  Motors& motors() { return motors_; }
  SimTime waits_for() const { return waits_for_; }

  /// The number of drives.
  std::size_t size() const { return nodes_.size(); }
  /// Nothing has stayed behind.
  bool settled() const { return motors_at_ == time_; }
  BusStats stats() const;  // like what follows, of a settled bus

  bool has(int id) const { return nodes_.has(id); }
  /// Whether the drive `id` answers commands for several drives, and those only. At any time.
  bool multi_drive_mode(int id) const { return nodes_.of(id).servo.multi_drive_mode(); }
  /// Where the drive `id` is found. At any time.
  const DrivePlace& place(int id) const { return nodes_.of(id).servo.place(); }
  /// Changes when some drive comes to be found elsewhere.
  std::uint64_t moves() const { return nodes_.moves(); }
  // Of the drive `id`.
  const Servo& servo(int id) const {
    assert(settled());
    return nodes_.of(id).servo;
  }
  model::Telemetry telemetry(int id) const;
  model::Truth truth(int id) const;
  Surroundings surroundings(int id) const;
  /// What the loops of the drive obey.
  model::Setpoint setpoint(int id) const;
  DriveView view(int id) const {
    return {servo(id), telemetry(id), truth(id), nodes_.of(id).joint, &body_};
  }
  /// Of the body that drives of the bus are on. At any time.
  const BodyState& body() const { return body_; }
  /// Moves out what the body has been told since the last call, in order; appended.
  void take_body_acts(std::vector<BodyAct>& out);
  /// What it has taken from its source since power-up.
  double drawn_J(int id) const;
  /// Of one that is mounted.
  model::MountedShaft mounted_shaft(int id) const;
  // Act now.
  void set_supply_drop(int id, double drop_V) { lane(nodes_.of(id)).set_supply_drop(drop_V); }
  /// The body has the drive's joint so.
  void mount(int id, const model::Mount& mount, const JointState& joint);
  void set_body(const BodyState& body) { body_ = body; }
  void set_load(int id, const model::LoadParams& load);
  void set_supply_voltage(int id, double supply_V);
  void set_ambient_temperature(int id, double ambient_C);
  /// The controller starts anew at once: as without power, what it was about to say or to write is
  /// lost. Nothing happens to a dead one.
  void power_cycle(int id);

 private:
  Lane lane(const Node& node) { return motors_.lane(node.motor); }
  /// Throws when no bus of these drives can carry it out.
  void check(const Directive& directive) const;
  bool enter(const TimedDirective& planned, Agenda::Rank rank);
  enum class Brought : std::uint8_t {
    kThere,
    kEdge,    // to the first instant before at which a drive dies or wakes
    kNotYet,  // others bring them
  };
  /// All motors to `t`, or only `one` and those that are computed with it.
  Brought bring_to(SimTime t, const Node* one = nullptr);
  Brought await(SimTime t);
  /// The same of those that what is due by `t` is about.
  Brought bring_concerned_to(SimTime t);
  /// They look at drives when they like.
  bool faults_or_conditions() const { return faults_.any_active() || !conditions_.empty(); }
  void follow_lives();
  /// `at`: the last instant at which it had power.
  void lose_power(Node& node, SimTime at);

  void perform(const Task& task);
  void step_supply(Node& node);
  void begin_fault(std::size_t fault);
  void keep_line();
  void end_fault(std::size_t fault);
  /// What the motor, the link and the firmware of a drive have to know of its faults.
  void pass_on_faults(Node& node);
  void look();
  void look_at_faults();
  void look_at(LiveFault& live);

  void deliver_next();
  bool line_is_kept();
  void echo(SimTime at);
  /// A frame has come from the wire: hosts get it, through their adapter.
  void to_host(TimedFrame frame);
  void bytes_to_host(TimedFrame frame);
  void lose_in_adapter();
  void hand_over(const TimedFrame& frame);
  /// The controller of a drive that has been brought to now starts anew.
  void restart(Node& node);
  /// Its firmware has started: where it is found may be elsewhere.
  void follow_start(Node& node);
  /// Its ID, bus or rate in force is another.
  void follow_place(Node& node);
  /// What becomes of one drive may decide what others hear.
  bool any_concerns_all() const;
  /// A part of 0x18 is over.
  void step_calibration(Node& node);
  void process_query(SimTime at, const protocol::Frame& frame);
  void process_multi_drive(SimTime at, const protocol::Frame& frame);
  /// A drive hears a frame that is for it. Returns why it does not answer; nothing when it does.
  std::optional<Drop> hear(SimTime at, Node& node, const protocol::Frame& frame);
  /// Whom a query is for, as the wire has it.
  enum class For : std::uint8_t { kOne, kSeveral };
  void answer(SimTime at, Node& node, const protocol::Query& query, For whom);
  /// What came before a reply.
  struct Before {
    bool mute;                 // nothing that the drive said left it
    std::uint64_t rom_writes;  // it had done so many
  };
  /// The reply leaves the drive from `ready` on, or when its flash is done.
  void say(SimTime at, SimTime ready, Node& node, const protocol::Reply& reply, Before before);
  /// How long after the last bit of a query the drive answers.
  SimTime reply_time(Node& node, For whom) const;
  void deliver(const WireDelivery& delivery);
  /// A drive at another bit rate answers what it hears with an error flag, until it is
  /// error-passive.
  bool is_disturbed();
  /// A fault destroys the frame whose last bit is due. Returns false when none does.
  bool destroy_next();
  /// The controller that wanted to send this has given it up.
  void leave_bus(const WireCandidate& given_up);
  /// The counter of whoever sends this.
  int& transmit_errors(const WireCandidate& frame);

  SimTime time_{0};
  SimTime motors_at_{0};  // where all of them are at least
  SimTime waits_for_{0};  // until others have brought them there
  Wire wire_;
  std::optional<SerialConfig> serial_;
  std::uint64_t seed_;
  Motors motors_;
  Nodes nodes_;
  HostLink host_link_;
  AdapterTimes own_adapter_;  // as configured; faults come on top
  HostAdapter adapter_;
  bool had_errors_ = false;  // some frame has been destroyed: error counters may stand above 0
  int flags_left_ = 0;       // of all nodes
  Agenda agenda_;
  Conditions conditions_;
  FaultBoard faults_;
  Duplicates duplicates_;
  std::vector<TimedFrame> replies_;   // hosts have got them; not yet taken
  std::vector<RomWrite> rom_writes_;  // not yet taken
  std::vector<BodyAct> body_acts_;    // not yet taken
  BodyState body_;
  std::shared_ptr<const BodySignals> body_signals_;  // conditions are of some of them
  BusStats stats_;                                   // sums over the drives are made on reading
};

}  // namespace lk::emulator
