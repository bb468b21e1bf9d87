#include "emulator/core/bus/bus.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "emulator/core/seed.hpp"
#include "emulator/core/servo/signals.hpp"

namespace lk::emulator {

namespace {

void deliver_to_host(BusState& bus, const TimedFrame& frame) {
  bus.replies.push_back(frame);
  if (frame.sender != 0) return;
  const int id = drive_of(frame);
  if (!frame.echo && bus.nodes.has(id)) bus.nodes.of(id).unasked.on_received(frame.frame);
  ++(frame.frame.kind == protocol::FrameKind::kError ? bus.own_stats.error_frames
                                                     : bus.own_stats.replies);
}

void count_adapter_overrun(BusState& bus) {
  ++bus.own_stats.replies_lost;
  ++bus.own_stats.replies_overrun;
}

/// Passes a frame to the adapter of RS-485 hosts as bytes. Bytes that do not fit into the queue are
/// lost without a report, as at a serial port.
void bytes_to_host(BusState& bus, TimedFrame frame) {
  const protocol::WireBytes bytes = protocol::wire_bytes(frame.frame);
  const std::size_t fits = std::min(bytes.size, bus.adapter.room());
  if (fits > 0 && fits < bytes.size) frame.frame = protocol::bytes_frame(bytes.view().first(fits));
  AdapterEffects shown = bus.adapter.from_wire(frame, fits > 0 ? fits : bytes.size);
  if (shown.lost) count_adapter_overrun(bus);
  shown.lost = shown.lost || fits < bytes.size;
  count_adapter(bus.faults, shown, frame.frame, bus.time);
}

/// Hosts that receive while they send read their own frame first.
void echo(BusState& bus, SimTime at) {
  LiveFault* const fault = bus.faults.first(kWholeBus, &FaultRow::echoes);
  if (fault == nullptr) return;
  const SerialWire* const wire = bus.wire.serial();
  if (wire == nullptr) return;
  const TimedFrame echo{.at = at, .frame = wire->written(), .echo = true};
  fault->took_effect(bus.time, kWholeBus, &echo.frame);
  ++bus.own_stats.extra_frames;
  to_host(bus, echo);
}

void deliver(BusState& bus, const WireDelivery& delivery) {
  if (bus.had_errors) {  // a success decrements the error counters
    count_success(bus.host.errors, delivery.from_host);
    if (!delivery.from_host) {
      int& errors = transmit_errors(bus, {delivery.frame, false, delivery.owner});
      errors = std::max(errors - 1, 0);
    }
  }
  if (delivery.from_host) {
    if (bus.host.unacknowledged || bus.host.to_replay > 0) count_sent(bus, delivery);
    if (delivery.from_pieces) {
      ++bus.own_stats.frames;
    } else {
      echo(bus, delivery.at);
    }
    if (delivery.owner != 0) {
      to_host(bus, {.at = delivery.at, .frame = delivery.frame, .sender = delivery.owner});
    }
    process_query(bus, delivery.at, delivery.frame);
    bus.own_stats.extra_frames +=
        bus.duplicates.process(delivery.at, delivery.frame, bus.wire, bus.faults, bus.time);
    return;
  }
  if (delivery.frame.dlc == 0 && bus.serial) {  // all bytes merged into those of another frame
    ++bus.own_stats.replies_lost;
    ++bus.own_stats.replies_collided;
    return;
  }
  if (delivery.met_host) {
    if (LiveFault* const holder = line_holder(bus.faults)) {
      holder->took_effect(bus.time, kWholeBus, &delivery.frame);
    }
  }
  const std::uint32_t id = delivery.owner & 0x3FU;
  const bool tells = (delivery.frame.id & 0x3FU) == id;
  to_host(bus, {delivery.at, delivery.frame, delivery.after_rom_write,
                tells ? 0 : static_cast<int>(id)});
}

void deliver_next(BusState& bus) {
  if (destroy_next(bus)) return;  // before the end of the frame, where receivers acknowledge it
  const CanWire* const can = bus.wire.can();
  if (can != nullptr && can->bitrate() > 0 && can->next_is_from_host() && !has_receiver(bus)) {
    return repeat_unacknowledged(bus, can->next().frame);
  }
  const auto delivery = bus.wire([&](auto& wire) { return wire.deliver(bus.time); });
  assert(delivery || bus.serial);
  if (delivery) deliver(bus, *delivery);
}

}  // namespace

BusState::BusState(const BusConfig& config)
    : wire(config),
      serial(config.serial),
      seed(config.seed),
      motors(config),
      host{.full = config.host_queue.full, .always_acknowledged = config.always_acknowledged},
      own_adapter(config.adapter != nullptr ? config.adapter->times : AdapterTimes{}),
      adapter(own_adapter, stream_seed(config.seed, kWholeBus, SeedStream::kAdapter)),
      faults(config.seed),
      body_signals(config.body_signals) {
  for (const ServoConfig& one : config.servos) {
    const MotorLocation location = motors.location_of(one, config);
    Servo firmware(one, motors.telemetry(location));
    const Power power(one.profile.drive.supply.v_source, motors.alive(location));
    const DriveLink link{.owner = protocol::kSingleDriveId + static_cast<std::uint32_t>(one.id)};
    nodes.add({std::move(firmware), location, power, Memory(), link});
    on_controller_start(*this, nodes.of(one.id));
  }
  rom_writes.reserve(nodes.size());
  if (body_signals) body = body_signals->beginning();
  for (const TimedDirective& event : config.events) plan_as_configured(*this, event);
}

bool receive(BusState& bus, const TimedFrame& in) {
  ++bus.own_stats.frames;
  if (in.frame.kind == protocol::FrameKind::kError) {
    bus.own_stats.drop(Reject::kErrorFrame);
    return true;
  }
  if (in.frame.kind == protocol::FrameKind::kFd) {
    bus.own_stats.drop(Reject::kCanFd);  // no classical bus carries it
    return true;
  }
  if (protocol::is_serial(in.frame) != bus.serial.has_value() ||
      (bus.serial && in.frame.dlc == 0)) {
    bus.own_stats.drop(bus.serial ? Reject::kNoPacket : Reject::kForeignId);
    return true;
  }
  const SimTime at = std::max(in.at, bus.time);
  if (bus.adapted() || bus.wire.host_queue_full()) advance_to(bus, at);
  SimTime ready = at;
  if (bus.adapted()) {
    const HostAdapter::ToWire written = bus.adapter.to_wire(at);
    count_adapter(bus.faults, written.shown, in.frame, at);
    ready = written.at;
  }
  return queue_from_host(bus, ready, in);
}

bool advance_to(BusState& bus, SimTime until) { return deliver_to(bus, until) && settle(bus); }

bool deliver_to(BusState& bus, SimTime until) {
  until = std::max(until, bus.time);
  for (;;) {
    const std::optional<SimTime> due = next_due(bus);
    SimTime target = std::max(std::min(due.value_or(until), until), bus.time);
    // When all motors advance together, stop at the start of a reply. If the replying drive dies
    // before, other frames take the wire, and no motor may be ahead of these frames.
    const std::optional<SimTime> start = bus.wire.next_reply_start();
    if ((bus.faults_or_conditions() || bus.flags_left > 0) && start && *start > bus.time) {
      target = std::min(target, *start);
    }
    const Advance advance = advance_affected_motors_to(bus, target);
    if (advance == Advance::kWaiting) return false;
    if (advance == Advance::kPowerEdge) continue;  // the due event may be void now
    bus.time = target;
    if (due && *due <= target) {
      if (bus.agenda.next_due() && *bus.agenda.next_due() <= bus.time) {
        perform(bus, bus.agenda.take());
      } else if (bus.adapter.next_due() && *bus.adapter.next_due() <= bus.time) {
        deliver_to_host(bus, bus.adapter.take());
      } else {
        deliver_next(bus);
      }
    } else if (target == until) {
      return true;
    }
  }
}

void Bus::take_replies(std::vector<TimedFrame>& out) {
  out.insert(out.end(), state_.replies.begin(), state_.replies.end());
  state_.replies.clear();
}

void Bus::take_rom_writes(std::vector<RomWrite>& out) {
  out.insert(out.end(), state_.rom_writes.begin(), state_.rom_writes.end());
  state_.rom_writes.clear();
}

void restore_rom(BusState& bus, int id, const Registers& rom, const RomWear& wear) {
  settle(bus);
  if (std::ranges::find(bus.rom_writes, id, &RomWrite::id) != bus.rom_writes.end()) {
    return;  // a later write, not yet taken, contains the change; storing it decides
  }
  Node& node = bus.nodes.of(id);
  if (node.memory.idle()) {
    restore_rom(node.servo, rom, wear);
  } else {
    // The pending write repeats the failed change; a power loss before its end undoes both.
    node.memory.set_before(rom, wear);
  }
}

std::optional<SimTime> next_due(const BusState& bus) {
  std::optional<SimTime> next;
  for (const auto& due : {bus.wire.next_due(), bus.agenda.next_due(), bus.adapter.next_due()}) {
    if (due && (!next || *due < *next)) next = due;
  }
  return next;
}

void to_host(BusState& bus, TimedFrame frame) {
  if (is_cut_off(bus, frame)) return;
  if (bus.serial) {
    const int id = static_cast<int>(frame.frame.id & 0x3FU);
    apply_to_read(bus.faults, frame.frame, bus.time);
    if (!frame.echo && frame.drive_id == 0) frame.drive_id = id;  // the bytes give no ID
  }
  if (!bus.adapter.in_use()) {
    deliver_to_host(bus, frame);
    return;
  }
  if (bus.serial) {
    bytes_to_host(bus, frame);
    return;
  }
  const AdapterEffects shown = bus.adapter.from_wire(frame);
  count_adapter(bus.faults, shown, frame.frame, bus.time);
  const bool reply = frame.sender == 0 && frame.frame.kind != protocol::FrameKind::kError;
  if (shown.lost && reply) count_adapter_overrun(bus);
  if (shown.reported) bus.adapter.from_wire({bus.time, report_overrun()}, 0);
}

const Servo& BusState::servo(int id) const {
  assert(settled());
  return nodes.of(id).servo;
}

DriveView BusState::view(int id) const {
  const Node& node = nodes.of(id);
  return {servo(id), telemetry(id), truth(id), node.unasked, node.joint, &body};
}

BusStats BusState::stats() const {
  assert(settled());
  BusStats sum = own_stats;
  wire([&](auto& on) {
    sum.wire_busy = on.busy();
    sum.frames_waiting = on.host_queue_size();
    sum.replies_waiting = on.drive_frames() + adapter.waiting();
  });
  if (wire.serial() != nullptr) sum.receiver = wire.serial()->receiver_stats();
  for (const Node& node : nodes) {
    sum.replies_waiting += node.link.held_back ? 1U : 0U;
    sum.refused_motion += node.servo.stats.refused_motion;
    sum.invalid_targets += node.servo.stats.invalid_targets;
    sum.rom_writes += node.servo.stats.rom_writes;
  }
  return sum;
}

}  // namespace lk::emulator
