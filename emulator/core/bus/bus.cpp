#include "emulator/core/bus/bus.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "emulator/core/seed.hpp"
#include "emulator/core/servo/signals.hpp"

namespace lk::emulator {

Bus::Bus(const BusConfig& config)
    : wire_(config),
      serial_(config.serial),
      seed_(config.seed),
      motors_(config),
      own_adapter_(config.adapter != nullptr ? config.adapter->times : AdapterTimes{}),
      adapter_(own_adapter_, stream_seed(config.seed, kWholeBus, SeedStream::kAdapter)),
      faults_(config.seed),
      body_signals_(config.body_signals) {
  for (const ServoConfig& servo : config.servos) {
    const MotorLocation motor = motors_.location_of(servo, config);
    Servo firmware(servo, motors_.telemetry(motor));
    const Power power(servo.profile.drive.supply.v_source, motors_.alive(motor));
    const DriveLink link{.owner = protocol::kSingleDriveId + static_cast<std::uint32_t>(servo.id)};
    nodes_.add({std::move(firmware), motor, power, Memory(), link});
    on_controller_start(nodes_.of(servo.id));
  }
  rom_writes_.reserve(nodes_.size());
  if (body_signals_) body_ = body_signals_->beginning();
  for (const TimedDirective& event : config.events) plan_as_configured(event);
}

void Bus::receive(const TimedFrame& in) {
  ++stats_.frames;
  if (in.frame.kind == protocol::FrameKind::kError) {
    stats_.drop(Drop::kErrorFrame);
    return;
  }
  if (in.frame.kind == protocol::FrameKind::kFd) {
    stats_.drop(Drop::kCanFd);  // no classical bus carries it
    return;
  }
  if (protocol::is_serial(in.frame) != serial_.has_value() || (serial_ && in.frame.dlc == 0)) {
    stats_.drop(serial_ ? Drop::kNoPacket : Drop::kForeignId);
    return;
  }
  const SimTime at = std::max(in.at, time_);
  if (adapted() || wire_.host_queue_full()) advance_to(at);
  if (wire_.host_queue_full()) {
    stats_.drop(Drop::kQueueFull);
    return;
  }
  if (adapted()) {
    const HostAdapter::ToWire written = adapter_.to_wire(at);
    faults_.count_adapter(written.shown, in.frame, at);
    wire_.send_from_host(written.at, in.frame, in.sender);
  } else {
    wire_.send_from_host(at, in.frame, in.sender);
  }
  stats_.queue_peak = std::max<std::uint64_t>(stats_.queue_peak, wire_.host_queue_size());
}

bool Bus::advance_to(SimTime until) { return deliver_to(until) && settle(); }

bool Bus::deliver_to(SimTime until) {
  until = std::max(until, time_);
  for (;;) {
    const std::optional<SimTime> due = next_due();
    SimTime target = std::max(std::min(due.value_or(until), until), time_);
    // When all motors advance together, stop at the start of a reply. If its drive dies before,
    // other frames take the wire, and no motor may be ahead of them.
    const std::optional<SimTime> start = wire_.next_reply_start();
    if ((faults_or_conditions() || flags_left_ > 0) && start && *start > time_) {
      target = std::min(target, *start);
    }
    const Advance advance = advance_affected_motors_to(target);
    if (advance == Advance::kWaiting) return false;
    if (advance == Advance::kPowerEdge) continue;  // the due event may be void now
    time_ = target;
    if (due && *due <= target) {
      if (agenda_.next_due() && *agenda_.next_due() <= time_) {
        perform(agenda_.take());
      } else if (adapter_.next_due() && *adapter_.next_due() <= time_) {
        deliver_to_host(adapter_.take());
      } else {
        deliver_next();
      }
    } else if (target == until) {
      return true;
    }
  }
}

void Bus::take_replies(std::vector<TimedFrame>& out) {
  out.insert(out.end(), replies_.begin(), replies_.end());
  replies_.clear();
}

void Bus::take_rom_writes(std::vector<RomWrite>& out) {
  out.insert(out.end(), rom_writes_.begin(), rom_writes_.end());
  rom_writes_.clear();
}

void Bus::restore_rom(int id, const Registers& rom, const RomWear& wear) {
  settle();
  if (std::ranges::find(rom_writes_, id, &RomWrite::id) != rom_writes_.end()) {
    return;  // who takes that write learns whether it is durable
  }
  Node& node = nodes_.of(id);
  if (node.memory.idle()) {
    emulator::restore_rom(node.servo, rom, wear);
  } else {
    // The pending write repeats the failed change; a power loss before its end undoes both.
    node.memory.set_before(rom, wear);
  }
}

std::optional<SimTime> Bus::next_due() const {
  std::optional<SimTime> next;
  for (const auto& due : {wire_.next_due(), agenda_.next_due(), adapter_.next_due()}) {
    if (due && (!next || *due < *next)) next = due;
  }
  return next;
}

/// Hosts that receive while they send read their own frame first.
void Bus::echo(SimTime at) {
  LiveFault* const fault = faults_.echo();
  if (fault == nullptr) return;
  const SerialWire* const wire = wire_.serial();
  if (wire == nullptr) return;
  const TimedFrame echo{.at = at, .frame = wire->written(), .echo = true};
  fault->took_effect(time_, kWholeBus, &echo.frame);
  ++stats_.extra_frames;
  to_host(echo);
}

void Bus::to_host(TimedFrame frame) {
  if (serial_) {
    const int id = static_cast<int>(frame.frame.id & 0x3FU);
    faults_.apply_to_read(frame.frame, time_);
    if (!frame.echo && frame.drive_id == 0) frame.drive_id = id;  // the bytes give no ID
  }
  if (!adapter_.in_use()) {
    deliver_to_host(frame);
    return;
  }
  if (serial_) {
    bytes_to_host(frame);
    return;
  }
  const AdapterEffects shown = adapter_.from_wire(frame);
  faults_.count_adapter(shown, frame.frame, time_);
  const bool reply = frame.sender == 0 && frame.frame.kind != protocol::FrameKind::kError;
  if (shown.lost && reply) count_adapter_overrun();
  if (shown.reported) adapter_.from_wire({time_, report_overrun()}, 0);
}

void Bus::count_adapter_overrun() {
  ++stats_.replies_lost;
  ++stats_.replies_overrun;
}

/// Serial ports handle bytes only: those that do not fit are lost without a report.
void Bus::bytes_to_host(TimedFrame frame) {
  const protocol::WireBytes bytes = protocol::wire_bytes(frame.frame);
  const std::size_t fits = std::min(bytes.size, adapter_.room());
  if (fits > 0 && fits < bytes.size) frame.frame = protocol::bytes_frame(bytes.view().first(fits));
  AdapterEffects shown = adapter_.from_wire(frame, fits > 0 ? fits : bytes.size);
  if (shown.lost) count_adapter_overrun();
  shown.lost = shown.lost || fits < bytes.size;
  faults_.count_adapter(shown, frame.frame, time_);
}

void Bus::deliver_to_host(const TimedFrame& frame) {
  replies_.push_back(frame);
  if (frame.sender != 0) return;
  ++(frame.frame.kind == protocol::FrameKind::kError ? stats_.error_frames : stats_.replies);
}

void Bus::deliver_next() {
  if (destroy_next()) return;
  const auto delivery = wire_.deliver(time_);
  assert(delivery || serial_);
  if (delivery) deliver(*delivery);
}

void Bus::deliver(const WireDelivery& delivery) {
  if (had_errors_) {  // a success decrements the error counters
    count_success(host_errors_, delivery.from_host);
    if (!delivery.from_host) {
      int& errors = transmit_errors({delivery.frame, false, delivery.owner});
      errors = std::max(errors - 1, 0);
    }
  }
  if (delivery.from_host) {
    if (delivery.from_pieces) {
      ++stats_.frames;
    } else {
      echo(delivery.at);
    }
    if (delivery.owner != 0) {
      to_host({.at = delivery.at, .frame = delivery.frame, .sender = delivery.owner});
    }
    process_query(delivery.at, delivery.frame);
    stats_.extra_frames += duplicates_.process(delivery.at, delivery.frame, wire_, faults_, time_);
    return;
  }
  if (delivery.frame.dlc == 0 && serial_) {  // its bytes cannot be told from another's
    ++stats_.replies_lost;
    ++stats_.replies_collided;
    return;
  }
  if (delivery.met_host) {
    if (LiveFault* const holder = faults_.line_holder()) {
      holder->took_effect(time_, kWholeBus, &delivery.frame);
    }
  }
  const std::uint32_t id = delivery.owner & 0x3FU;
  const bool tells = (delivery.frame.id & 0x3FU) == id;
  to_host(
      {delivery.at, delivery.frame, delivery.after_rom_write, tells ? 0 : static_cast<int>(id)});
}

BusStats Bus::stats() const {
  assert(settled());
  BusStats sum = stats_;
  sum.wire_busy = wire_.busy();
  if (wire_.serial() != nullptr) sum.receiver = wire_.serial()->receiver_stats();
  sum.frames_waiting = wire_.host_queue_size();
  sum.replies_waiting = wire_.drive_frames() + adapter_.waiting();
  for (const Node& node : nodes_) {
    sum.replies_waiting += node.link.held_back ? 1U : 0U;
    sum.refused_motion += node.servo.stats.refused_motion;
    sum.invalid_targets += node.servo.stats.invalid_targets;
    sum.rom_writes += node.servo.stats.rom_writes;
  }
  return sum;
}

}  // namespace lk::emulator
