#include "emulator/program/answered_ids.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "emulator/ground/start_error.hpp"
#include "emulator/program/config_listing.hpp"

namespace lk::emulator {

void AnsweredIds::take(const BusConfig& bus, const LinkState& link) {
  links_.emplace(bus.interface, link);
  for (const ServoConfig& servo : bus.servos) locks_.take(bus.interface, link, servo.id);
}

void AnsweredIds::start(const Line& line) {
  lock(line, Taken::kOrFail);
  tell(line);
}

void AnsweredIds::follow(const Line& line) {
  lock(line, Taken::kOrWarn);
  tell(line);
}

void AnsweredIds::lock(const Line& line, Taken taken) {
  const auto& servos = line.config().servos;
  const auto answers_at = [&](int id) {
    return std::ranges::any_of(
        servos, [&](const ServoConfig& servo) { return line.bus().place(servo.id).id == id; });
  };
  for (int id = protocol::kMinId; id <= protocol::kMaxId; ++id) {
    if (!answers_at(id)) {
      locks_.release(line.name(), id);
    } else if (!locks_.holds(line.name(), id)) {
      try {
        locks_.take(line.name(), links_.at(line.name()), id);
      } catch (const StartError& problem) {
        if (taken == Taken::kOrFail) throw;
        spdlog::warn("{}", problem.what());
      }
    }
  }
}

void AnsweredIds::tell(const Line& line) {
  for (const ServoConfig& servo : line.config().servos) {
    const std::string note = place_note(line.bus().place(servo.id), servo);
    std::string& told = told_[{line.name(), servo.id}];
    if (note == told) continue;
    told = note;
    if (note.empty()) {
      spdlog::warn("{}: drive {} answers at its ID again", line.name(), servo.id);
    } else {
      spdlog::warn("{}: drive {} {}", line.name(), servo.id, note);
    }
  }
}

std::string moved_text(const Line& line) {
  std::string text;
  for (const ServoConfig& servo : line.config().servos) {
    const std::string note = place_note(line.bus().place(servo.id), servo);
    if (note.empty()) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : "; ", servo.id, note);
  }
  return text.empty() ? "" : " (" + text + ")";
}

}  // namespace lk::emulator
