// Motors of a bus: advancing them, and reactions to a controller that dies or starts.

#include <algorithm>
#include <bit>
#include <utility>

#include "emulator/core/bus/bus.hpp"

namespace lk::emulator {

bool Bus::settle() {
  while (!settled()) {
    if (advance_motors_to(time_) == Advance::kWaiting) return false;
  }
  return true;
}

bool Bus::reach(SimTime t) {
  if (t > SimTime{0} && !advance_to(t - SimTime{1})) return false;
  for (;;) {
    const Advance advance = advance_motors_to(t);
    if (advance == Advance::kWaiting) return false;
    if (advance == Advance::kReached) break;
  }
  time_ = std::max(time_, t);
  return true;
}

Bus::Advance Bus::advance_motors_to(SimTime t, const Node* one) {
  if (motors_.shared()) [[unlikely]]
    return await_shared_motors(t);
  const bool edge = one != nullptr ? motors_.advance_to(t, one->motor) : motors_.advance_to(t);
  if (one == nullptr && !duplicates_.empty()) duplicates_.advance_to(t);
  if (edge) {
    update_power();
  } else if (one == nullptr) {
    motors_at_ = t;
  }
  return edge ? Advance::kPowerEdge : Advance::kReached;
}

/// For motors that others advance. A drive that has died or started stays at that instant until
/// `update_power` has run.
[[gnu::noinline]] Bus::Advance Bus::await_shared_motors(SimTime t) {
  const auto changed = [this](const Node& node) {
    return motors_.alive(node.motor) != node.power.alive;
  };
  if (std::ranges::any_of(nodes_, changed)) {
    update_power();
    return Advance::kPowerEdge;
  }
  if (!motors_.have_reached(t)) {
    waits_for_ = t;
    return Advance::kWaiting;
  }
  if (!duplicates_.empty()) duplicates_.advance_to(t);
  motors_at_ = t;
  return Advance::kReached;
}

/// Drives interact on the wire only. Without faults and conditions, which read several drives, a
/// drive without traffic may lag. Motors advanced together stop where a drive dies: its frame is
/// void, and none is ahead of what follows.
Bus::Advance Bus::advance_affected_motors_to(SimTime t) {
  if (faults_or_conditions()) {
    return advance_motors_to(t);
  }
  const bool agenda_due = agenda_.next_due() && *agenda_.next_due() <= t;
  const bool wire_due = wire_.next_due() && *wire_.next_due() <= t;
  const std::optional<SimTime> start = wire_.next_reply_start();
  const bool replies = start && *start <= t;
  // If the drive of an unfinished reply dies, a frame behind it may have had the wire by now.
  if (!agenda_due && !wire_due && !(replies && wire_.several_wait())) {
    return Advance::kReached;
  }
  if (nodes_.size() == 1 || any_affects_others()) {
    return advance_motors_to(t);
  }
  if (replies) {
    const Advance advance =
        advance_motors_to(t, &nodes_.of(static_cast<int>(wire_.next().owner & 0x3FU)));
    if (advance != Advance::kReached || !agenda_due) return advance;
  }
  if (agenda_due) return advance_motors_to(t);
  const protocol::Frame next = wire_.next().frame;
  if (next.kind == protocol::FrameKind::kBytes)
    return advance_motors_to(t);  // a packet may end here
  const auto addressed = protocol::address(next);
  const int* const id = std::get_if<int>(&addressed);
  if (id != nullptr && *id == protocol::kMultiDrive) {
    return advance_motors_to(t);
  }
  const std::uint32_t drives = id != nullptr ? nodes_.at_address(*id) : 0;
  if (std::popcount(drives) > 1) return advance_motors_to(t);
  Advance advance = Advance::kReached;
  nodes_.each(drives, [&](const Node& node) { advance = advance_motors_to(t, &node); });
  return advance;
}

/// Updates drives that have died or started. Motors may be at different times then: drives interact
/// on the wire only, and each is advanced before its frames take effect.
void Bus::update_power() {
  for (Node& node : nodes_) {
    const bool alive = motors_.alive(node.motor);
    if (alive == node.power.alive) continue;
    node.power.alive = alive;
    if (alive) {
      node.started = motors_.time(node.motor);
      emulator::power_cycle(node.servo, lane(node));
      on_controller_start(node);
    } else {
      // A frame that would start at the end of the tick does not start.
      lose_power(node, motors_.time(node.motor) - SimTime{1});
    }
  }
}

/// Pending replies and pending ROM writes are lost.
void Bus::lose_power(Node& node, SimTime at) {
  stats_.replies_lost += node.link.drop_all(wire_, at);
  node.link.errors = 0;
  if (std::exchange(node.link.bus_off, false)) agenda_.cancel<BusOffEnd>(node.id());
  agenda_.cancel<CalibrationStep>(node.id());
  if (node.memory.lose_power(node.servo)) agenda_.cancel<RomWritten>(node.id());
}

void Bus::power_cycle(int id) {
  settle();
  Node& node = nodes_.of(id);
  if (node.power.alive) restart(node);
}

void Bus::restart(Node& node) {
  lose_power(node, time_);
  node.started = time_;
  emulator::power_cycle(node.servo, lane(node));
  on_controller_start(node);
}

/// A drive with a new address at restart, at another rate, or holding the line affects the others.
/// So its power state has to be known first.
bool Bus::any_affects_others() const {
  return flags_left_ > 0 || std::ranges::any_of(nodes_, [](const Node& node) {
           return node.servo.holds_line() || node.servo.address_changes_at_restart();
         });
}

void Bus::on_controller_start(Node& node) {
  faults_.count_firmware_effects(node.servo, time_);
  on_address_change(node);
}

void Bus::on_address_change(Node& node) {
  nodes_.update_addresses();
  const bool disturbs = node.servo.on_its_bus() && !node.servo.at_its_rate();
  flags_left_ -= node.flags_left;
  node.flags_left = disturbs ? kFlagsToPassive : 0;
  flags_left_ += node.flags_left;
}

model::Telemetry Bus::telemetry(int id) const {
  assert(settled());
  return motors_.telemetry(nodes_.of(id).motor);
}

model::Truth Bus::truth(int id) const {
  assert(settled());
  return motors_.truth(nodes_.of(id).motor);
}

double Bus::drawn_J(int id) const {
  assert(settled());
  const MotorLocation& location = nodes_.of(id).motor;
  return motors_.bank(location).energy(motors_.index(location)).supply;
}

model::MountedShaft Bus::mounted_shaft(int id) const {
  assert(settled());
  const MotorLocation& location = nodes_.of(id).motor;
  return motors_.bank(location).mounted_shaft(motors_.index(location));
}

void Bus::take_body_acts(std::vector<BodyAct>& out) {
  out.insert(out.end(), body_acts_.begin(), body_acts_.end());
  body_acts_.clear();
}

void Bus::mount(int id, const model::Mount& mount, const JointState& joint) {
  Node& node = nodes_.of(id);
  node.joint = joint;
  lane(node).mount(mount);
}

DriveConditions Bus::drive_conditions(int id) const {
  assert(settled());
  const MotorLocation& location = nodes_.of(id).motor;
  const model::DriveBank& bank = motors_.bank(location);
  const std::size_t index = motors_.index(location);
  const model::DriveParams& params = bank.params(index);
  return {bank.connected(index), params.supply.v_source, params.thermal.temp_ambient, params.load};
}

model::Setpoint Bus::setpoint(int id) const {
  assert(settled());
  const MotorLocation& location = nodes_.of(id).motor;
  return motors_.bank(location).setpoint(motors_.index(location));
}

}  // namespace lk::emulator
