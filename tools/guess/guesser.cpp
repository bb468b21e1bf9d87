#include "tools/guess/guesser.hpp"

#include <utility>

#include "tools/guess/guess_output.hpp"

namespace lk::emulator {
namespace {

/// Returns a reader for drives with all commands of a series on a wire.
FrameReader every_command(Series series, const protocol::Dialect& wire) {
  BusConfig bus;
  for (int id = protocol::kMinId; id <= protocol::kMaxId; ++id) {
    ServoConfig servo;
    servo.id = id;
    servo.profile.series = series;
    servo.quirks.manual_reply_bytes = true;  // also accepts DATA[0] as printed in the manual
    auto& dialect = servo.quirks.dialect;
    dialect = wire;
    dialect.pid_commands = true;
    dialect.offset_command = true;
    dialect.open_loop_command = true;
    dialect.brake_command = true;
    dialect.parameter_commands = true;
    dialect.multi_drive_more = true;
    dialect.max_torque_commands = true;
    dialect.setting_commands = true;
    dialect.calibrate_command = true;
    dialect.restart_command = true;
    dialect.speed_iq_limit = true;
    dialect.clear_turns_command = true;
    dialect.zero_ram_command = true;
    dialect.restore_command = true;
    bus.servos.push_back(std::move(servo));
  }
  return FrameReader(bus);
}

/// Returns the readers for CAN. One dialect is enough: positions of fields do not matter for
/// telling queries from replies.
std::vector<FrameReader> can_readers() {
  return {every_command(Series::kMf, protocol::kLegacyDialect),
          every_command(Series::kMs, protocol::kLegacyDialect)};
}

/// Returns the readers for RS-485. Dialects matter here: packets of the manuals differ in length.
std::vector<FrameReader> serial_readers() {
  return {every_command(Series::kMf, protocol::kM35Dialect),
          every_command(Series::kMf, protocol::kM36bDialect),
          every_command(Series::kMs, protocol::kM35Dialect)};
}

void settle(GuessedBus& bus) {
  for (const QueryOutcome& settled : bus.conversation.take_outcomes()) {
    bus.drives[settled.drive].settle(settled);
  }
}

}  // namespace

Guesser::Guesser(Options options)
    : options_(std::move(options)),
      can_readers_(can_readers()),
      serial_readers_(serial_readers()) {}

std::string Guesser::take(std::string_view line) {
  ++lines_;
  const auto parsed = parse_candump_text(line);
  if (std::holds_alternative<NoFrame>(parsed)) return "";
  if (const auto* problem = std::get_if<std::string>(&parsed)) {
    refuse(*problem);
    return "";
  }
  const auto& shown = std::get<PrintedFrame>(parsed);
  const auto framing = protocol::framing_of(shown.line.frame);
  const std::pair wire(shown.line.interface, framing);
  if (!buses_.contains(wire) && buses_.size() >= kMaxInterfaces) {
    ++unread_frames_;
    return "";
  }
  const auto& readers = framing == protocol::Framing::kCan ? can_readers_ : serial_readers_;
  GuessedBus& bus = buses_.try_emplace(wire, readers).first->second;
  const auto at = stamps_.time_of(shown);
  if (stamps_.steps() && !std::exchange(steps_, true)) {
    for (auto& [key, one] : buses_) one.conversation.forget_times();
  }
  if (!begin_) begin_ = at;
  ++frames_;
  ++bus.frames;
  classify(bus, {shown.line.frame, at, from_host(shown.line.direction)});
  return "";
}

void Guesser::classify(GuessedBus& bus, const BusFrame& observed) {
  const FrameInfo info = bus.conversation.classify(observed);
  settle(bus);
  if (info.role == Role::kQuery && info.drive == 0) {
    for (auto& [id, drive] : bus.drives) drive.query(info, observed.at);
  } else if (info.role == Role::kQuery) {
    bus.drives[info.drive].query(info, observed.at);
  } else if (info.role == Role::kReply) {
    bus.drives[info.drive].reply(info, observed.frame, observed.at);
  } else if (info.role == Role::kUnclear) {
    bus.drives[info.drive].unclear(info, observed.at);
  } else if (info.role == Role::kOther) {
    ++bus.others;
  }
}

std::string Guesser::finish() {
  for (auto& [wire, bus] : buses_) {
    bus.conversation.end();
    settle(bus);
  }
  return options_.json ? guess_json(*this) : guess_text(*this, options_.language);
}

Guess Guesser::guess(const DriveWatch& drive) const {
  Guess guess = guess_of(drive.evidence());
  const auto& product = drive.evidence().product();
  if (product && options_.motor_of) guess.motor = options_.motor_of(product->motor);
  return guess;
}

/// Counts a line that is not a frame, and keeps the first problem.
void Guesser::refuse(const std::string& problem) {
  if (bad_lines_++ == 0) first_problem_ = "line " + std::to_string(lines_) + ": " + problem;
}

}  // namespace lk::emulator
