#include "emulator/core/bus/bus.hpp"

#include <algorithm>
#include <cassert>
#include <iterator>

#include "emulator/core/wire_timing.hpp"

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
  }
  return Drop::kForeignId;
}

}  // namespace

Bus::Bus(const BusConfig& config)
    : bitrate_(config.bitrate), wire_(config.bitrate), seed_(config.seed) {
  index_of_id_.fill(-1);
  const std::vector<MotorPlace> motors = build_motors(config);
  nodes_.reserve(config.servos.size());
  rom_writes_.reserve(config.servos.size());
  for (std::size_t k = 0; k < config.servos.size(); ++k) {
    const ServoConfig& servo = config.servos[k];
    assert(servo.id >= protocol::kMinId && servo.id <= protocol::kMaxId && !has(servo.id));
    assert(k == 0 || servo.id > config.servos[k - 1].id);
    index_of_id_[static_cast<std::size_t>(servo.id)] = static_cast<std::int8_t>(k);
    const model::DriveBank& drives = banks_[motors[k].bank].drives;
    nodes_.push_back({Servo(servo, drives.telemetry(motors[k].lane)), motors[k]});
    nodes_.back().timeline.supply_V = servo.profile.drive.supply.v_source;
    nodes_.back().timeline.alive = drives.alive(motors[k].lane);
  }
  for (const TimedDirective& event : config.events) {
    plan(event);
  }
}

void Bus::receive(const TimedFrame& in) {
  ++stats_.frames;
  if (in.frame.kind == protocol::FrameKind::kError) {
    drop(Drop::kErrorFrame);
    return;
  }
  if (in.frame.kind == protocol::FrameKind::kFd) {
    drop(Drop::kCanFd);  // no classical bus carries it
    return;
  }
  const SimTime at = std::max(in.at, time_);
  if (wire_.host_queue_full()) {
    advance_to(at);
  }
  if (wire_.host_queue_full()) {
    drop(Drop::kQueueFull);
    return;
  }
  wire_.send_from_host(at, in.frame);
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
      happen();
    } else if (target == until) {
      return;
    }
  }
}

/// What is due at `time()`, the first of it.
void Bus::happen() {
  if (agenda_.next_due() && *agenda_.next_due() <= time_) {
    perform(agenda_.take());
  } else {
    deliver_next();
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
  std::vector<Timeline::Writing>& writing = nodes_[index_of(id)].timeline.writing;
  if (writing.empty()) {
    nodes_[index_of(id)].servo.restore_rom(rom, wear);
  } else {
    // It brings what the failed one brought; only if the power cuts it short is that gone.
    writing.front().rom_before = rom;
    writing.front().wear_before = wear;
  }
}

std::optional<SimTime> Bus::next_due() const {
  const std::optional<SimTime> wire = wire_.next_due();
  const std::optional<SimTime> agenda = agenda_.next_due();
  return wire && agenda ? std::min(wire, agenda) : wire ? wire : agenda;
}

void Bus::deliver_next() {
  if (destroy_next()) {
    return;
  }
  const auto delivery = wire_.deliver(time_);
  assert(delivery);
  if (had_errors_) {
    count_success(*delivery);
  }
  if (delivery->from_host) {
    process_query(delivery->at, delivery->frame);
    duplicates_hear(delivery->at, delivery->frame);
  } else {
    const std::uint32_t id = delivery->owner & 0x3FU;
    const bool tells = (delivery->frame.id & 0x3FU) == id;
    replies_.push_back({delivery->at, delivery->frame, delivery->after_rom_write,
                        tells ? 0 : static_cast<int>(id)});
    ++stats_.replies;
  }
}

void Bus::process_query(SimTime at, const protocol::Frame& frame) {
  const auto addressed = protocol::address(frame);
  if (const auto* reject = std::get_if<protocol::Reject>(&addressed)) {
    drop(drop_cause(*reject));
    return;
  }
  const int id = std::get<int>(addressed);
  if (id != protocol::kMultiDrive && !has(id)) {
    drop(Drop::kNoSuchDrive);
    return;
  }
  if (id == protocol::kMultiDrive) {
    process_multi_drive(at, frame);
    return;
  }
  count_command(id, frame);
  if (!nodes_[index_of(id)].timeline.alive) {
    drop(Drop::kNoPower);
    return;
  }
  Servo& servo = nodes_[index_of(id)].servo;
  if (servo.multi_drive_mode()) {
    servo.count_wrong_mode();
    drop(Drop::kWrongMode);
    return;
  }
  protocol::Frame heard = frame;
  if (!hears(index_of(id), heard)) {
    drop(Drop::kFault);
    return;
  }
  const auto understood = servo.understand(heard);
  if (const auto* query = std::get_if<protocol::Query>(&understood)) {
    if (busy(index_of(id))) {
      ignored_for_full_queue(index_of(id), heard);
      drop(Drop::kDriveBusy);
      return;
    }
    ++stats_.queries;
    answer(at, index_of(id), *query);
  } else {
    servo.count_unknown_command();
    drop(Drop::kUnknownCommand);
  }
}

/// Each drive hears the frame in its own way. When none answers, the cause is that of the drive
/// that came closest to it.
void Bus::process_multi_drive(SimTime at, const protocol::Frame& frame) {
  if (!nodes_.empty() &&
      std::ranges::none_of(nodes_, [](const Node& node) { return node.timeline.alive; })) {
    drop(Drop::kNoPower);
    return;
  }
  bool answered = false;
  Drop cause = frame.id == protocol::MultiTorque::kIdentifier ? Drop::kWrongMode : Drop::kForeignId;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    if (!nodes_[k].timeline.alive) {
      continue;
    }
    Servo& servo = nodes_[k].servo;
    protocol::Frame heard = frame;
    if (!hears(k, heard)) {
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
      if (busy(k)) {
        ignored_for_full_queue(k, heard);
        cause = Drop::kDriveBusy;
        continue;
      }
      answer(at, k, *query);
      answered = true;
    } else if (cause == Drop::kForeignId) {
      cause = Drop::kWrongMode;
    }
  }
  if (answered) {
    ++stats_.queries;
  } else {
    drop(cause);
  }
}

void Bus::answer(SimTime at, std::size_t index, const protocol::Query& query) {
  Servo& servo = nodes_[index].servo;
  const std::uint64_t writes_before = servo.stats().rom_writes;
  const protocol::Reply reply = servo.handle(query, lane(index));
  // Without a modelled wire the drive has no reply time either; flash takes its time all the same.
  SimTime ready = bitrate_ > 0 ? at + servo.reply_time() : at;
  std::uint64_t rom_write = 0;
  if (servo.stats().rom_writes != writes_before) {
    rom_write = servo.stats().rom_writes;
    ready = std::max(ready, begin_rom_write(index, at));
  }
  book_firmware(index);
  if (active_fault(index, FaultKind::kSlowReplies) != nullptr) {
    for (LiveFault& live : faults_) {
      if (live.fault.kind == FaultKind::kSlowReplies && live.active() && live.is_of(servo.id())) {
        ready += from_ms(live.value(0));
        took_effect(live, servo.id());
      }
    }
  }
  say(index, ready, servo.encode(reply), rom_write);
}

BusStats Bus::stats() const {
  assert(settled());
  BusStats sum = stats_;
  sum.wire_busy = wire_.busy();
  sum.frames_waiting = wire_.host_queue_size();
  sum.replies_waiting = wire_.drive_frames();
  for (const Node& node : nodes_) {
    sum.replies_waiting += node.link.held_back ? 1U : 0U;
    sum.refused_motion += node.servo.stats().refused_motion;
    sum.invalid_targets += node.servo.stats().invalid_targets;
    sum.rom_writes += node.servo.stats().rom_writes;
  }
  return sum;
}

bool Bus::has(int id) const {
  return id >= protocol::kMinId && id <= protocol::kMaxId &&
         index_of_id_[static_cast<std::size_t>(id)] >= 0;
}

std::size_t Bus::index_of(int id) const {
  assert(has(id));
  return static_cast<std::size_t>(index_of_id_[static_cast<std::size_t>(id)]);
}

}  // namespace lk::emulator
