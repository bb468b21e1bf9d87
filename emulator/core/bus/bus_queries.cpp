// Reaction of drives to frames of hosts: which drives receive a frame, and when they reply.

#include <algorithm>
#include <utility>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/seed.hpp"

namespace lk::emulator {
namespace {

/// Number of drives that a query addresses.
enum class Addressees : std::uint8_t { kOne, kSeveral };

/// State of a drive before it executes a command.
struct PriorState {
  bool mute;                 // nothing that the drive sends leaves it
  std::uint64_t rom_writes;  // number of ROM writes so far
};

/// Returns the time from the end of a query to the reply, without flash writes; 0 on a CAN bus
/// without bit timing. After a multi-drive packet on RS-485 each drive has a time slot, whether or
/// not the drives before it answer (docs/reference/rs485.md).
SimTime reply_time(const BusState& bus, Node& node, Addressees whom) {
  const ServoConfig& config = node.servo.config;
  if (!bus.serial) return bus.wire.bitrate() > 0 ? config.reply_time : SimTime{0};
  if (whom == Addressees::kSeveral) {
    constexpr int kReplyBits = 130;
    const SimTime before = bus.serial->broadcast_reply_time.value_or(
        bus.wire.bitrate() >= 4'000'000   ? std::chrono::microseconds(30)
        : bus.wire.bitrate() >= 2'000'000 ? std::chrono::microseconds(45)
                                          : std::chrono::microseconds(90));
    return before + (node.servo.address() - protocol::kMinId) *
                        (bits_duration(kReplyBits, bus.wire.bitrate()) + before);
  }
  if (config.reply_spread == SimTime{0}) return config.reply_time;
  const std::uint64_t drawn =
      mix(stream_seed(bus.seed, node.id(), SeedStream::kReplyTime) + node.link.replies_drawn++);
  const double share = 2 * uniform(drawn) - 1;
  return std::max(
      config.reply_time + SimTime(static_cast<std::int64_t>(
                              share * static_cast<double>(config.reply_spread.count()))),
      SimTime{0});
}

/// Sends the reply to a query at `ready`, or later, when the flash has stored the change. `at`: end
/// of the query.
void send_reply(BusState& bus, SimTime at, SimTime ready, Node& node, const protocol::Reply& reply,
                PriorState before) {
  Servo& servo = node.servo;
  const bool silent = std::holds_alternative<protocol::NoReply>(reply);
  Outgoing sent{.ready = ready, .frame = silent ? protocol::Frame{} : encode(servo, reply)};
  if (servo.stats.rom_writes != before.rom_writes) {
    sent.after_rom_write = servo.stats.rom_writes;
    const SimTime done = node.memory.begin(at, servo);
    bus.agenda.schedule(done, RomWritten{node.id()});
    sent.ready = std::max(sent.ready, done);
  }
  if (silent) return;
  node.unasked.on_answer(reply, sent.frame.data[0]);
  if (before.mute) {
    count_firmware_effects(bus.faults, servo, bus.time);
    ++bus.own_stats.replies_lost;
    return;
  }
  if (!bus.faults.any_active()) {
    node.link.last_frame = sent;
    bus.own_stats.replies_lost += node.link.send(bus.wire, sent);
    return;
  }
  count_firmware_effects(bus.faults, servo, bus.time);
  const FaultedReply made =
      apply_to_reply(bus.faults, node.id(), node.link, sent, bus.wire.bitrate(), bus.time);
  if (!made.stale) node.link.last_frame = sent;
  bus.own_stats.extra_frames += made.extra;
  bus.own_stats.replies_lost += made.lost + node.link.send_all(bus.wire, made.out);
}

/// `frame`: the query as received.
void answer(BusState& bus, SimTime at, Node& node, const protocol::Query& query,
            const protocol::Frame& frame, Addressees whom) {
  Servo& servo = node.servo;
  const PriorState before{servo.is_mute(), servo.stats.rom_writes};
  const bool calibrated = servo.calibrating();
  const DriveAddress address = servo.bus_address;
  const Lane lane = bus.lane(node);
  const model::Setpoint setpoint = lane.bank.inputs(lane.index).setpoint;
  const protocol::Reply reply = handle(servo, query, lane);
  node.unasked.on_executed(at, servo, query, frame, setpoint, lane);
  schedule_unasked(bus, node);
  if (!calibrated && servo.calibrating()) {
    bus.agenda.schedule(at + servo.config.calibrate_time / 2, CalibrationStep{node.id()});
  }
  send_reply(bus, at, at + reply_time(bus, node, whom), node, reply, before);
  if (take_address_change(servo) && servo.bus_address != address) on_address_change(bus, node);
  if (take_restart(servo)) restart(bus, node);
}

/// Returns true, and counts the drop, if a drive holds the RS-485 line: no drive receives frames.
bool line_is_held(BusState& bus) {
  if (!bus.serial) return false;
  const auto holder = std::ranges::find_if(
      bus.nodes, [](const Node& node) { return node.power.alive && node.servo.holds_line(); });
  if (holder == bus.nodes.end()) return false;
  holder->servo.effective_faults.hangs_after_off |= holder->servo.faults.hangs_after_off;
  count_firmware_effects(bus.faults, holder->servo, bus.time);
  bus.own_stats.drop(Reject::kFault);
  return true;
}

/// Lets a drive process a frame addressed to it. Returns why it does not answer, nullopt if it
/// does.
std::optional<Reject> process_for_drive(BusState& bus, SimTime at, Node& node,
                                        const protocol::Frame& frame) {
  node.unasked.on_query(at, bus.host.to_replay > 0);
  // A condition on this query acts before the drive processes it.
  if (!bus.conditions.empty() && bus.conditions.count(node.id(), frame.data[0], bus.time))
    sample(bus);
  if (!node.power.alive) return Reject::kNoPower;
  Servo& servo = node.servo;
  if (servo.multi_drive_mode()) {
    ++servo.stats.wrong_mode;
    return Reject::kWrongMode;
  }
  protocol::Frame received = frame;
  if (!apply_to_query(bus.faults, node.link, servo, received, bus.time)) return Reject::kFault;
  if (servo.ignores_queries()) {
    bus.lane(node).feed_input();  // restarts the lost-input window
    return Reject::kDriveBusy;
  }
  if (node.link.is_deaf(bus.wire, at)) return Reject::kDriveBusy;
  if (bus.serial) keep_received(servo, received);
  const auto understood = understand(servo, received);
  const auto* query = std::get_if<protocol::Query>(&understood);
  if (query == nullptr) {
    ++servo.stats.unknown_commands;
    return std::get<Reject>(understood);
  }
  if (node.link.full(bus.wire)) {
    count_ignored(bus.faults, node.id(), received, bus.time);
    return Reject::kDriveBusy;
  }
  answer(bus, at, node, *query, received, Addressees::kOne);
  return std::nullopt;
}

/// Lets every drive process a multi-drive frame, in the order of addresses. If no drive answers,
/// the drop has the cause of the last drive with a fault, an unknown command or a busy state.
/// Without such a drive, wrong mode precedes foreign ID.
void process_multi_drive(BusState& bus, SimTime at, const protocol::Frame& frame) {
  if (bus.nodes.size() > 0 &&
      std::ranges::none_of(bus.nodes, [](const Node& node) { return node.power.alive; })) {
    bus.own_stats.drop(Reject::kNoPower);
    return;
  }
  if (line_is_held(bus)) return;
  bool answered = false;
  Reject cause =
      frame.id == protocol::MultiTorque::kIdentifier ? Reject::kWrongMode : Reject::kForeignId;
  bus.nodes.each_by_address([&](Node& node) {
    Servo& servo = node.servo;
    if (servo.multi_drive_mode()) node.unasked.on_query(at, bus.host.to_replay > 0);
    if (!node.power.alive) return;
    protocol::Frame received = frame;
    if (!apply_to_query(bus.faults, node.link, servo, received, bus.time)) {
      cause = Reject::kFault;
      return;
    }
    const auto understood = understand(servo, received);
    const auto* query = std::get_if<protocol::Query>(&understood);
    if (query == nullptr) {
      const bool unknown = std::get<Reject>(understood) == Reject::kUnknownCommand;
      if (unknown && servo.multi_drive_mode()) {
        ++servo.stats.unknown_commands;
        cause = Reject::kUnknownCommand;
      }
    } else if (servo.multi_drive_mode()) {
      if (servo.ignores_queries()) bus.lane(node).feed_input();
      if (node.link.cannot_receive(bus.wire, at) || servo.ignores_queries()) {
        count_ignored(bus.faults, node.id(), received, bus.time);
        cause = Reject::kDriveBusy;
        return;
      }
      answer(bus, at, node, *query, received, Addressees::kSeveral);
      answered = true;
    } else if (cause == Reject::kForeignId) {
      cause = Reject::kWrongMode;
    }
  });
  if (answered) {
    ++bus.own_stats.queries;
  } else {
    bus.own_stats.drop(cause);
  }
}

}  // namespace

void schedule_unasked(BusState& bus, Node& node) {
  const auto next = node.unasked.take_next_step(bus.time, bus.lane(node));
  if (next) bus.agenda.schedule(*next, UnaskedStep{node.id()});
}

void process_query(BusState& bus, SimTime at, const protocol::Frame& frame) {
  const auto addressed = protocol::address(frame);
  if (const auto* reject = std::get_if<Reject>(&addressed)) {
    bus.own_stats.drop(*reject);
    return;
  }
  const int id = std::get<int>(addressed);
  if (id == protocol::kMultiDrive) {
    process_multi_drive(bus, at, frame);
    return;
  }
  if (line_is_held(bus)) return;
  const std::uint32_t drives = bus.nodes.at_address(id);
  if (drives == 0) {
    bus.own_stats.drop(Reject::kNoSuchDrive);
    return;
  }
  bool answered = false;
  Reject cause = Reject::kNoSuchDrive;
  bus.nodes.each(drives, [&](Node& node) {
    const auto silent = process_for_drive(bus, at, node, frame);
    answered = answered || !silent;
    cause = silent.value_or(cause);
  });
  if (answered) {
    ++bus.own_stats.queries;
  } else {
    bus.own_stats.drop(cause);
  }
}

void step_calibration(BusState& bus, Node& node) {
  const SimTime part = node.servo.config.calibrate_time / 2;
  if (!node.servo.calibrating()) return;
  if (turn_back(node.servo, bus.lane(node))) {
    bus.agenda.schedule(bus.time + part, CalibrationStep{node.id()});
    return;
  }
  const PriorState before{node.servo.is_mute(), node.servo.stats.rom_writes};
  const protocol::Reply reply = finish_calibration(
      node.servo, bus.lane(node), stream_seed(bus.seed, node.id(), SeedStream::kAlign));
  send_reply(bus, bus.time, bus.time, node, reply, before);
}

}  // namespace lk::emulator
