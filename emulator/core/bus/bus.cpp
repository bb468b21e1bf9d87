#include "emulator/core/bus/bus.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "emulator/core/seed.hpp"

namespace lk::emulator {
namespace {

Drop drop_cause(protocol::Reject reject) {
  switch (reject) {
    case protocol::Reject::kErrorFrame:
      return Drop::kErrorFrame;
    case protocol::Reject::kCanFd:
      return Drop::kCanFd;
    case protocol::Reject::kRemote:
      return Drop::kRemote;
    case protocol::Reject::kExtended:
      return Drop::kExtended;
    case protocol::Reject::kForeignId:
      return Drop::kForeignId;
    case protocol::Reject::kWrongLength:
      return Drop::kWrongLength;
    case protocol::Reject::kUnknownCommand:
      return Drop::kUnknownCommand;
    case protocol::Reject::kNoPacket:
      return Drop::kNoPacket;
  }
  return Drop::kForeignId;
}

}  // namespace

Bus::Bus(const BusConfig& config)
    : wire_(config),
      serial_(config.serial),
      seed_(config.seed),
      motors_(config),
      own_adapter_(config.adapter != nullptr ? config.adapter->times : AdapterTimes{}),
      adapter_(own_adapter_, stream_seed(config.seed, kWholeBus, SeedStream::kAdapter)),
      faults_(config.seed) {
  for (const ServoConfig& servo : config.servos) {
    const MotorPlace motor = motors_.place_of(servo, config);
    Servo firmware(servo, motors_.bank(motor).telemetry(motor.lane));
    const Power power(servo.profile.drive.supply.v_source, motors_.alive(motor));
    const DriveLink link{.owner = firmware.reply_id()};
    nodes_.add({std::move(firmware), motor, power, Memory(), link});
  }
  rom_writes_.reserve(nodes_.size());
  for (const TimedDirective& event : config.events) plan(event);
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

void Bus::advance_to(SimTime until) {
  deliver_to(until);
  settle();
}

void Bus::deliver_to(SimTime until) {
  until = std::max(until, time_);
  for (;;) {
    const std::optional<SimTime> due = next_due();
    SimTime target = std::max(std::min(due.value_or(until), until), time_);
    // Where everybody is brought, nobody may be ahead of what happens when a drive dies before its
    // frame starts: the wire is left to others then.
    const std::optional<SimTime> start = wire_.next_reply_start();
    if (faults_or_conditions() && start && *start > time_) {
      target = std::min(target, *start);
    }
    if (bring_concerned_to(target)) {
      continue;  // what was due may be void
    }
    time_ = target;
    if (due && *due <= target) {
      if (agenda_.next_due() && *agenda_.next_due() <= time_) {
        perform(agenda_.take());
      } else if (adapter_.next_due() && *adapter_.next_due() <= time_) {
        hand_over(adapter_.take());
      } else {
        deliver_next();
      }
    } else if (target == until) {
      return;
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
    return;  // whoever takes that one will hear whether it is durable
  }
  Node& node = nodes_.of(id);
  if (node.memory.idle()) {
    node.servo.restore_rom(rom, wear);
  } else {
    // It brings what the failed one brought; only if the power cuts it short is that gone.
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

void Bus::to_host(const TimedFrame& frame) {
  if (!adapter_.in_use()) {
    hand_over(frame);
    return;
  }
  const AdapterShown shown = adapter_.from_wire(frame);
  faults_.count_adapter(shown, frame.frame, time_);
  const bool reply = frame.sender == 0 && frame.frame.kind != protocol::FrameKind::kError;
  if (shown.lost && reply) ++stats_.replies_lost;
  if (shown.reported) adapter_.from_wire({time_, report_overrun()}, 0);
}

void Bus::hand_over(const TimedFrame& frame) {
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
  if (had_errors_) {  // everybody's counters go down again
    count_success(host_link_, delivery.from_host);
    if (!delivery.from_host) {
      int& errors = transmit_errors({delivery.frame, false, delivery.owner});
      errors = std::max(errors - 1, 0);
    }
  }
  if (delivery.from_host) {
    if (delivery.from_pieces) ++stats_.frames;
    if (delivery.owner != 0)
      to_host({.at = delivery.at, .frame = delivery.frame, .sender = delivery.owner});
    process_query(delivery.at, delivery.frame);
    stats_.extra_frames += duplicates_.hear(delivery.at, delivery.frame, wire_, faults_, time_);
    return;
  }
  if (delivery.frame.dlc == 0 && serial_) {  // nothing of it could be told from another's
    ++stats_.replies_lost;
    return;
  }
  const std::uint32_t id = delivery.owner & 0x3FU;
  const bool tells = (delivery.frame.id & 0x3FU) == id;
  to_host(
      {delivery.at, delivery.frame, delivery.after_rom_write, tells ? 0 : static_cast<int>(id)});
}

void Bus::process_query(SimTime at, const protocol::Frame& frame) {
  const auto addressed = protocol::address(frame);
  if (const auto* reject = std::get_if<protocol::Reject>(&addressed)) {
    stats_.drop(drop_cause(*reject));
    return;
  }
  const int id = std::get<int>(addressed);
  if (id != protocol::kMultiDrive && !has(id)) {
    stats_.drop(Drop::kNoSuchDrive);
    return;
  }
  if (id == protocol::kMultiDrive) {
    process_multi_drive(at, frame);
    return;
  }
  // Whoever waits for the query has its turn before the drive hears it.
  if (!conditions_.empty() && conditions_.count(id, frame.data[0], time_)) look();
  Node& node = nodes_.of(id);
  if (!node.power.alive) {
    stats_.drop(Drop::kNoPower);
    return;
  }
  Servo& servo = node.servo;
  if (servo.multi_drive_mode()) {
    servo.count_wrong_mode();
    stats_.drop(Drop::kWrongMode);
    return;
  }
  protocol::Frame heard = frame;
  if (!faults_.hear(node.link, servo, heard, time_)) {
    stats_.drop(Drop::kFault);
    return;
  }
  if (serial_ && node.link.deaf(wire_)) {
    stats_.drop(Drop::kDriveBusy);
    return;
  }
  if (serial_) servo.keep_received(heard);
  const auto understood = servo.understand(heard);
  if (const auto* query = std::get_if<protocol::Query>(&understood)) {
    if (node.link.full(wire_)) {
      faults_.count_ignored(node.id(), heard, time_);
      stats_.drop(Drop::kDriveBusy);
      return;
    }
    ++stats_.queries;
    answer(at, node, *query, For::kOne);
  } else {
    servo.count_unknown_command();
    stats_.drop(drop_cause(std::get<protocol::Reject>(understood)));
  }
}

/// Each drive hears the frame in its own way. When none answers, the cause is that of the drive
/// that came closest to it.
void Bus::process_multi_drive(SimTime at, const protocol::Frame& frame) {
  if (nodes_.size() > 0 &&
      std::ranges::none_of(nodes_, [](const Node& node) { return node.power.alive; })) {
    stats_.drop(Drop::kNoPower);
    return;
  }
  bool answered = false;
  Drop cause = frame.id == protocol::MultiTorque::kIdentifier ? Drop::kWrongMode : Drop::kForeignId;
  for (Node& node : nodes_) {
    if (!node.power.alive) continue;
    Servo& servo = node.servo;
    protocol::Frame heard = frame;
    if (!faults_.hear(node.link, servo, heard, time_)) {
      cause = Drop::kFault;
      continue;
    }
    const auto understood = servo.understand(heard);
    const auto* query = std::get_if<protocol::Query>(&understood);
    if (query == nullptr) {
      const bool unknown =
          std::get<protocol::Reject>(understood) == protocol::Reject::kUnknownCommand;
      if (unknown && servo.multi_drive_mode()) {
        servo.count_unknown_command();
        cause = Drop::kUnknownCommand;
      }
    } else if (servo.multi_drive_mode()) {
      if (node.link.deaf(wire_)) {
        faults_.count_ignored(node.id(), heard, time_);
        cause = Drop::kDriveBusy;
        continue;
      }
      answer(at, node, *query, For::kSeveral);
      answered = true;
    } else if (cause == Drop::kForeignId) {
      cause = Drop::kWrongMode;
    }
  }
  if (answered) {
    ++stats_.queries;
  } else {
    stats_.drop(cause);
  }
}

void Bus::answer(SimTime at, Node& node, const protocol::Query& query, For whom) {
  Servo& servo = node.servo;
  const bool mute = servo.is_mute();
  const std::uint64_t writes_before = servo.stats().rom_writes;
  const protocol::Reply reply = servo.handle(query, lane(node));
  const bool silent = std::holds_alternative<protocol::NoReply>(reply);
  Outgoing said{.ready = at + reply_time(node, whom),
                .frame = silent ? protocol::Frame{} : servo.encode(reply)};
  if (servo.stats().rom_writes != writes_before) {
    said.after_rom_write = servo.stats().rom_writes;
    const SimTime done = node.memory.begin(at, servo);
    agenda_.enter(done, RomWritten{node.id()});
    said.ready = std::max(said.ready, done);
  }
  if (silent) return;
  if (mute) {
    faults_.count_shown(servo, time_);
    ++stats_.replies_lost;
    return;
  }
  if (!faults_.any_active()) {
    node.link.last_said = said;
    stats_.replies_lost += node.link.send(wire_, said);
    return;
  }
  faults_.count_shown(servo, time_);
  const FaultBoard::Said made = faults_.say(node.id(), node.link, said, time_);
  if (!made.stale) node.link.last_said = said;
  stats_.extra_frames += made.extra;
  stats_.replies_lost += made.lost + node.link.send_all(wire_, made.out);
}

/// Without a modelled wire a drive on CAN has no reply time either; flash takes its time all the
/// same. After a packet for several each has its turn by time, whether or not those before it
/// answer (docs/rs485.md).
SimTime Bus::reply_time(Node& node, For whom) const {
  const ServoConfig& config = node.servo.config();
  if (!serial_) return wire_.bitrate() > 0 ? config.reply_time : SimTime{0};
  if (whom == For::kSeveral) {
    constexpr int kReplyBits = 130;
    const SimTime before = serial_->broadcast_reply_time.value_or(
        wire_.bitrate() >= 4'000'000   ? std::chrono::microseconds(30)
        : wire_.bitrate() >= 2'000'000 ? std::chrono::microseconds(45)
                                       : std::chrono::microseconds(90));
    return before + (node.id() - protocol::kMinId) * (wire_.bits(kReplyBits) + before);
  }
  if (config.reply_spread == SimTime{0}) return config.reply_time;
  const std::uint64_t drawn =
      mix(stream_seed(seed_, node.id(), SeedStream::kReplyTime) + node.link.replies_drawn++);
  const double share = 2 * uniform(drawn) - 1;
  return std::max(
      config.reply_time + SimTime(static_cast<std::int64_t>(
                              share * static_cast<double>(config.reply_spread.count()))),
      SimTime{0});
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
    sum.refused_motion += node.servo.stats().refused_motion;
    sum.invalid_targets += node.servo.stats().invalid_targets;
    sum.rom_writes += node.servo.stats().rom_writes;
  }
  return sum;
}

}  // namespace lk::emulator
