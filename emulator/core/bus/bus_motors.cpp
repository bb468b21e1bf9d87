// Motors of a bus: advancing them, and reactions to a controller that dies or starts.

#include <algorithm>
#include <bit>
#include <utility>

#include "emulator/core/bus/bus.hpp"

namespace lk::emulator {

namespace {

/// Drops pending replies and ROM writes of a drive without power. `at`: last instant with power.
void lose_power(BusState& bus, Node& node, SimTime at) {
  bus.own_stats.replies_lost += node.link.drop_all(bus.wire, at);
  node.link.errors = 0;
  if (std::exchange(node.link.bus_off, false)) bus.agenda.cancel<BusOffEnd>(node.id());
  bus.agenda.cancel<CalibrationStep>(node.id());
  if (node.memory.lose_power(node.servo)) bus.agenda.cancel<RomWritten>(node.id());
}

/// Updates drives that have died or started. The motors may then be at different times, because
/// drives interact on the wire only, and each is advanced before its frames take effect.
void update_power(BusState& bus) {
  for (Node& node : bus.nodes) {
    const bool alive = bus.motors.alive(node.motor);
    if (alive == node.power.alive) continue;
    node.power.alive = alive;
    if (alive) {
      node.started = bus.motors.time(node.motor);
      power_cycle(node.servo, bus.lane(node));
      on_controller_start(bus, node);
    } else {
      // A frame that would start at the end of the tick does not start.
      lose_power(bus, node, bus.motors.time(node.motor) - SimTime{1});
    }
  }
}

/// As `advance_motors_to`, for motors that SharedMotors advances. A drive that has died or started
/// stays at that instant until `update_power` has run.
[[gnu::noinline]] Advance await_shared_motors(BusState& bus, SimTime t) {
  const auto changed = [&bus](const Node& node) {
    return bus.motors.alive(node.motor) != node.power.alive;
  };
  if (std::ranges::any_of(bus.nodes, changed)) {
    update_power(bus);
    return Advance::kPowerEdge;
  }
  if (!bus.motors.have_reached(t)) {
    bus.waits_for = t;
    return Advance::kWaiting;
  }
  if (!bus.duplicates.empty()) bus.duplicates.advance_to(t);
  bus.motors_at = t;
  return Advance::kReached;
}

/// Returns true if a drive affects others when it dies or starts. Its address changes at restart,
/// it is at another bit rate, or it holds the line. Its motor must then advance with the others.
bool any_affects_others(const BusState& bus) {
  return bus.flags_left > 0 || std::ranges::any_of(bus.nodes, [](const Node& node) {
           return node.servo.holds_line() || node.servo.address_changes_at_restart();
         });
}

}  // namespace

bool settle(BusState& bus) {
  while (!bus.settled()) {
    if (advance_motors_to(bus, bus.time) == Advance::kWaiting) return false;
  }
  return true;
}

bool reach(BusState& bus, SimTime t) {
  if (t > SimTime{0} && !advance_to(bus, t - SimTime{1})) return false;
  for (;;) {
    const Advance advance = advance_motors_to(bus, t);
    if (advance == Advance::kWaiting) return false;
    if (advance == Advance::kReached) break;
  }
  bus.time = std::max(bus.time, t);
  return true;
}

Advance advance_motors_to(BusState& bus, SimTime t, const Node* one) {
  if (bus.motors.shared()) [[unlikely]]
    return await_shared_motors(bus, t);
  const bool edge =
      one != nullptr ? bus.motors.advance_to(t, one->motor) : bus.motors.advance_to(t);
  if (one == nullptr && !bus.duplicates.empty()) bus.duplicates.advance_to(t);
  if (edge) {
    update_power(bus);
  } else if (one == nullptr) {
    bus.motors_at = t;
  }
  return edge ? Advance::kPowerEdge : Advance::kReached;
}

/// Drives interact on the wire only. Without faults and conditions, which read several drives, a
/// drive without traffic may lag. Motors that advance together stop where a drive dies. Its frame
/// is then not sent, and no motor may be ahead of the frames that follow instead.
Advance advance_affected_motors_to(BusState& bus, SimTime t) {
  if (bus.faults_or_conditions()) {
    return advance_motors_to(bus, t);
  }
  const bool agenda_due = bus.agenda.next_due() && *bus.agenda.next_due() <= t;
  const std::optional<SimTime> wire_next = bus.wire.next_due();
  const bool wire_due = wire_next && *wire_next <= t;
  const std::optional<SimTime> start = bus.wire.next_reply_start();
  const bool replies = start && *start <= t;
  // If the drive that sends a reply dies, a frame behind the reply may use the wire earlier.
  const auto several_wait = [](auto& wire) { return wire.several_wait(); };
  if (!agenda_due && !wire_due && !(replies && bus.wire(several_wait))) return Advance::kReached;
  if (bus.nodes.size() == 1 || any_affects_others(bus)) {
    return advance_motors_to(bus, t);
  }
  if (replies) {
    const Advance advance =
        advance_motors_to(bus, t, &bus.nodes.of(static_cast<int>(bus.wire.next().owner & 0x3FU)));
    if (advance != Advance::kReached || !agenda_due) return advance;
  }
  if (agenda_due) return advance_motors_to(bus, t);
  const protocol::Frame next = bus.wire.next().frame;
  if (next.kind == protocol::FrameKind::kBytes)
    return advance_motors_to(bus, t);  // a packet may end here
  const auto addressed = protocol::address(next);
  const int* const id = std::get_if<int>(&addressed);
  if (id != nullptr && *id == protocol::kMultiDrive) {
    return advance_motors_to(bus, t);
  }
  const std::uint32_t drives = id != nullptr ? bus.nodes.at_address(*id) : 0;
  if (std::popcount(drives) > 1) return advance_motors_to(bus, t);
  Advance advance = Advance::kReached;
  bool acknowledged = bus.serial.has_value();
  bus.nodes.each(drives, [&](const Node& node) {
    advance = advance_motors_to(bus, t, &node);
    acknowledged = acknowledged || node.power.alive;
  });
  // Without the addressed drive, any other may acknowledge.
  if (advance == Advance::kReached && !acknowledged) return advance_motors_to(bus, t);
  return advance;
}

void power_cycle(BusState& bus, int id) {
  settle(bus);
  Node& node = bus.nodes.of(id);
  if (node.power.alive) restart(bus, node);
}

void restart(BusState& bus, Node& node) {
  lose_power(bus, node, bus.time);
  node.started = bus.time;
  power_cycle(node.servo, bus.lane(node));
  on_controller_start(bus, node);
}

void on_controller_start(BusState& bus, Node& node) {
  node.unasked.on_event(node.servo.starts > 1 ? AngleEvent::kRestart : AngleEvent::kStart);
  count_firmware_effects(bus.faults, node.servo, bus.time);
  on_address_change(bus, node);
}

void on_address_change(BusState& bus, Node& node) {
  bus.nodes.update_addresses();
  const bool disturbs = node.servo.on_its_bus() && !node.servo.at_its_rate();
  bus.flags_left -= node.flags_left;
  node.flags_left = disturbs ? kFlagsToPassive : 0;
  bus.flags_left += node.flags_left;
}

model::Telemetry BusState::telemetry(int id) const {
  assert(settled());
  return motors.telemetry(nodes.of(id).motor);
}

model::Truth BusState::truth(int id) const {
  assert(settled());
  return motors.truth(nodes.of(id).motor);
}

double BusState::drawn_J(int id) const {
  assert(settled());
  const MotorLocation& location = nodes.of(id).motor;
  return motors.bank(location).energy(motors.index(location)).supply;
}

model::MountedShaft BusState::mounted_shaft(int id) const {
  assert(settled());
  const MotorLocation& location = nodes.of(id).motor;
  return motors.bank(location).mounted_shaft(motors.index(location));
}

void Bus::take_body_acts(std::vector<BodyAct>& out) {
  out.insert(out.end(), state_.body_acts.begin(), state_.body_acts.end());
  state_.body_acts.clear();
}

void BusState::mount(int id, const model::Mount& mount, const JointState& joint) {
  Node& node = nodes.of(id);
  node.joint = joint;
  lane(node).mount(mount);
}

DriveConditions BusState::drive_conditions(int id) const {
  assert(settled());
  const MotorLocation& location = nodes.of(id).motor;
  const model::DriveBank& bank = motors.bank(location);
  const std::size_t index = motors.index(location);
  const model::DriveInputs& inputs = bank.inputs(index);
  const model::DriveParams& params = inputs.params;
  return {inputs.connected, params.supply.v_source, params.thermal.temp_ambient, params.load};
}

model::Setpoint BusState::setpoint(int id) const {
  assert(settled());
  const MotorLocation& location = nodes.of(id).motor;
  return motors.bank(location).inputs(motors.index(location)).setpoint;
}

}  // namespace lk::emulator
