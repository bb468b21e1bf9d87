// Reaction of drives to frames of hosts: who receives them, what is answered, and when.

#include <algorithm>
#include <utility>

#include "emulator/core/bus/bus.hpp"
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

void Bus::process_query(SimTime at, const protocol::Frame& frame) {
  const auto addressed = protocol::address(frame);
  if (const auto* reject = std::get_if<protocol::Reject>(&addressed)) {
    stats_.drop(drop_cause(*reject));
    return;
  }
  const int id = std::get<int>(addressed);
  if (id == protocol::kMultiDrive) {
    process_multi_drive(at, frame);
    return;
  }
  if (line_is_held()) return;
  const std::uint32_t drives = nodes_.at_address(id);
  if (drives == 0) {
    stats_.drop(Drop::kNoSuchDrive);
    return;
  }
  bool answered = false;
  Drop cause = Drop::kNoSuchDrive;
  nodes_.each(drives, [&](Node& node) {
    const auto silent = process_for_drive(at, node, frame);
    answered = answered || !silent;
    cause = silent.value_or(cause);
  });
  if (answered) {
    ++stats_.queries;
  } else {
    stats_.drop(cause);
  }
}

std::optional<Drop> Bus::process_for_drive(SimTime at, Node& node, const protocol::Frame& frame) {
  // A condition on this query acts before the drive processes it.
  if (!conditions_.empty() && conditions_.count(node.id(), frame.data[0], time_)) sample();
  if (!node.power.alive) return Drop::kNoPower;
  Servo& servo = node.servo;
  if (servo.multi_drive_mode()) {
    ++servo.stats.wrong_mode;
    return Drop::kWrongMode;
  }
  protocol::Frame received = frame;
  if (!faults_.apply_to_query(node.link, servo, received, time_)) return Drop::kFault;
  if (servo.ignores_queries()) {
    lane(node).feed_input();  // restarts the lost-input window
    return Drop::kDriveBusy;
  }
  if (wire_.cannot_receive(node.link.owner, at)) return Drop::kDriveBusy;
  if (serial_) keep_received(servo, received);
  const auto understood = understand(servo, received);
  const auto* query = std::get_if<protocol::Query>(&understood);
  if (query == nullptr) {
    ++servo.stats.unknown_commands;
    return drop_cause(std::get<protocol::Reject>(understood));
  }
  if (node.link.full(wire_)) {
    faults_.count_ignored(node.id(), received, time_);
    return Drop::kDriveBusy;
  }
  answer(at, node, *query, Addressees::kOne);
  return std::nullopt;
}

/// Returns true, and counts the drop, if a drive holds the RS-485 line: no drive receives frames.
bool Bus::line_is_held() {
  if (!serial_) return false;
  const auto holder = std::ranges::find_if(
      nodes_, [](const Node& node) { return node.power.alive && node.servo.holds_line(); });
  if (holder == nodes_.end()) return false;
  holder->servo.effective_faults.hangs_after_off |= holder->servo.faults.hangs_after_off;
  faults_.count_firmware_effects(holder->servo, time_);
  stats_.drop(Drop::kFault);
  return true;
}

/// Every drive processes the frame and answers in the order of addresses. If none answers, the
/// cause is that of the drive that came closest.
void Bus::process_multi_drive(SimTime at, const protocol::Frame& frame) {
  if (nodes_.size() > 0 &&
      std::ranges::none_of(nodes_, [](const Node& node) { return node.power.alive; })) {
    stats_.drop(Drop::kNoPower);
    return;
  }
  if (line_is_held()) return;
  bool answered = false;
  Drop cause = frame.id == protocol::MultiTorque::kIdentifier ? Drop::kWrongMode : Drop::kForeignId;
  nodes_.each_by_address([&](Node& node) {
    Servo& servo = node.servo;
    if (!node.power.alive) return;
    protocol::Frame received = frame;
    if (!faults_.apply_to_query(node.link, servo, received, time_)) {
      cause = Drop::kFault;
      return;
    }
    const auto understood = understand(servo, received);
    const auto* query = std::get_if<protocol::Query>(&understood);
    if (query == nullptr) {
      const bool unknown =
          std::get<protocol::Reject>(understood) == protocol::Reject::kUnknownCommand;
      if (unknown && servo.multi_drive_mode()) {
        ++servo.stats.unknown_commands;
        cause = Drop::kUnknownCommand;
      }
    } else if (servo.multi_drive_mode()) {
      if (servo.ignores_queries()) lane(node).feed_input();
      if (node.link.cannot_receive(wire_, at) || servo.ignores_queries()) {
        faults_.count_ignored(node.id(), received, time_);
        cause = Drop::kDriveBusy;
        return;
      }
      answer(at, node, *query, Addressees::kSeveral);
      answered = true;
    } else if (cause == Drop::kForeignId) {
      cause = Drop::kWrongMode;
    }
  });
  if (answered) {
    ++stats_.queries;
  } else {
    stats_.drop(cause);
  }
}

void Bus::answer(SimTime at, Node& node, const protocol::Query& query, Addressees whom) {
  Servo& servo = node.servo;
  const PriorState before{servo.is_mute(), servo.stats.rom_writes};
  const bool calibrated = servo.calibrating();
  const DriveAddress address = servo.bus_address;
  const protocol::Reply reply = handle(servo, query, lane(node));
  if (!calibrated && servo.calibrating()) {
    agenda_.schedule(at + servo.config.calibrate_time / 2, CalibrationStep{node.id()});
  }
  send_reply(at, at + reply_time(node, whom), node, reply, before);
  if (take_address_change(servo) && servo.bus_address != address) on_address_change(node);
  if (take_restart(servo)) restart(node);
}

void Bus::send_reply(SimTime at, SimTime ready, Node& node, const protocol::Reply& reply,
                     PriorState before) {
  Servo& servo = node.servo;
  const bool silent = std::holds_alternative<protocol::NoReply>(reply);
  Outgoing sent{.ready = ready, .frame = silent ? protocol::Frame{} : encode(servo, reply)};
  if (servo.stats.rom_writes != before.rom_writes) {
    sent.after_rom_write = servo.stats.rom_writes;
    const SimTime done = node.memory.begin(at, servo);
    agenda_.schedule(done, RomWritten{node.id()});
    sent.ready = std::max(sent.ready, done);
  }
  if (silent) return;
  if (before.mute) {
    faults_.count_firmware_effects(servo, time_);
    ++stats_.replies_lost;
    return;
  }
  if (!faults_.any_active()) {
    node.link.last_frame = sent;
    stats_.replies_lost += node.link.send(wire_, sent);
    return;
  }
  faults_.count_firmware_effects(servo, time_);
  const FaultBoard::FaultedReply made =
      faults_.apply_to_reply(node.id(), node.link, sent, wire_.bitrate(), time_);
  if (!made.stale) node.link.last_frame = sent;
  stats_.extra_frames += made.extra;
  stats_.replies_lost += made.lost + node.link.send_all(wire_, made.out);
}

void Bus::step_calibration(Node& node) {
  const SimTime part = node.servo.config.calibrate_time / 2;
  if (!node.servo.calibrating()) return;
  if (turn_back(node.servo, lane(node))) {
    agenda_.schedule(time_ + part, CalibrationStep{node.id()});
    return;
  }
  const PriorState before{node.servo.is_mute(), node.servo.stats.rom_writes};
  const protocol::Reply reply =
      finish_calibration(node.servo, lane(node), stream_seed(seed_, node.id(), SeedStream::kAlign));
  send_reply(time_, time_, node, reply, before);
}

/// A CAN bus without bit timing has no reply time; flash writes still take time. After a
/// multi-drive packet each drive has a time slot, whether or not those before it answer
/// (docs/reference/rs485.md).
SimTime Bus::reply_time(Node& node, Addressees whom) const {
  const ServoConfig& config = node.servo.config;
  if (!serial_) return wire_.bitrate() > 0 ? config.reply_time : SimTime{0};
  if (whom == Addressees::kSeveral) {
    constexpr int kReplyBits = 130;
    const SimTime before = serial_->broadcast_reply_time.value_or(
        wire_.bitrate() >= 4'000'000   ? std::chrono::microseconds(30)
        : wire_.bitrate() >= 2'000'000 ? std::chrono::microseconds(45)
                                       : std::chrono::microseconds(90));
    return before + (node.servo.address() - protocol::kMinId) * (wire_.bits(kReplyBits) + before);
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

}  // namespace lk::emulator
