#include "tools/guess/guesser.hpp"

#include <utility>

#include "tools/guess/guess_json.hpp"
#include "tools/guess/guess_text.hpp"

namespace lk::emulator {
namespace {

/// Drives that know all commands of a series. Where fields are does not matter to who says what.
BusConfig every_command(Series series) {
  BusConfig bus;
  for (int id = protocol::kMinId; id <= protocol::kMaxId; ++id) {
    ServoConfig servo;
    servo.id = id;
    servo.profile.series = series;
    servo.quirks.manual_reply_bytes = true;  // as well as those of the query
    auto& dialect = servo.quirks.dialect;
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
    bus.servos.push_back(std::move(servo));
  }
  return bus;
}

}  // namespace

Guesser::Guesser(Options options)
    : options_(options),
      reader_(every_command(Series::kMf)),
      ms_reader_(every_command(Series::kMs)) {}

std::string Guesser::take(std::string_view line) {
  ++lines_;
  const auto parsed = parse_candump_text(line);
  if (std::holds_alternative<NothingShown>(parsed)) return "";
  if (const auto* problem = std::get_if<std::string>(&parsed)) {
    refuse(*problem);
    return "";
  }
  const auto& shown = std::get<ShownFrame>(parsed);
  if (!buses_.contains(shown.line.interface) && buses_.size() >= kMostInterfaces) {
    ++unread_frames_;
    return "";
  }
  GuessedBus& bus = buses_.try_emplace(shown.line.interface, reader_, ms_reader_).first->second;
  const auto at = stamps_.time_of(shown);
  if (stamps_.steps() && !std::exchange(steps_, true)) {
    for (auto& [interface, one] : buses_) one.conversation.forget_times();
  }
  if (!begin_) begin_ = at;
  ++frames_;
  ++bus.frames;
  hear(bus, {shown.line.frame, at, from_host(shown.line.direction)});
  return "";
}

void Guesser::hear(GuessedBus& bus, const HeardFrame& heard) {
  const Told told = bus.conversation.hear(heard);
  for (const Settled& settled : bus.conversation.take_settled()) {
    bus.drives[settled.drive].settle(settled);
  }
  if (told.role == Role::kQuery && told.drive == 0) {
    for (auto& [id, drive] : bus.drives) drive.query(told, heard.at);
  } else if (told.role == Role::kQuery) {
    bus.drives[told.drive].query(told, heard.at);
  } else if (told.role == Role::kReply) {
    bus.drives[told.drive].reply(told, heard.frame, heard.at);
  } else if (told.role == Role::kUnclear) {
    bus.drives[told.drive].unclear(told, heard.at);
  } else if (told.role == Role::kOther) {
    ++bus.others;
  }
}

std::string Guesser::finish() {
  for (auto& [interface, bus] : buses_) {
    bus.conversation.end();
    for (const Settled& settled : bus.conversation.take_settled()) {
      bus.drives[settled.drive].settle(settled);
    }
  }
  return options_.json ? guess_json(*this) : guess_text(*this, options_.language);
}

/// The first is kept, all are counted.
void Guesser::refuse(const std::string& problem) {
  if (bad_lines_++ == 0) first_problem_ = "line " + std::to_string(lines_) + ": " + problem;
}

}  // namespace lk::emulator
