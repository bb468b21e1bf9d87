#include "tools/decode/summary.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace lk::emulator {

void BusTally::count(const Told& told, const FrameWords& words, const std::optional<SimTime>& at) {
  ++frames;
  framing = protocol::framing_of(told.frame);
  if (at && !first_at) first_at = at;
  if (at) last_at = at;
  if (!words.drawback.empty()) {
    ++meaningless[words.drawback];
    const bool known_elsewhere =
        (told.drive > 0 || protocol::find_multi_drive(told.frame.id) != nullptr) &&
        !words.name.empty();
    if (known_elsewhere) ++of_newer_firmware;
    return;
  }
  if (told.role == Role::kOther) return;
  CommandTally& tally = commands[{told.drive, told.asked}];
  if (told.role == Role::kQuery) ++tally.queries;
  if (told.role == Role::kUnclear) ++tally.unclear;
  if (told.role != Role::kReply) return;
  ++tally.replies;
  if (told.choices == 0) ++tally.orphans;
  const auto state = std::ranges::find(words.quantities, "errors", &ReplyValue::name);
  if (state == words.quantities.end()) return;
  for (const std::string_view word : error_words(static_cast<unsigned>(state->value))) {
    ErrorTally& error = errors[{told.drive, word}];
    if (error.replies++ == 0) error.first_at = at;
  }
}

void BusTally::count(const Settled& settled) {
  CommandTally& tally = commands[{settled.drive, settled.asked}];
  switch (settled.how) {
    case Settled::How::kUnanswered:
      ++tally.unanswered;
      break;
    case Settled::How::kOpen:
      ++tally.open;
      break;
    case Settled::How::kAnswered:
      if (settled.latency) tally.latency.add(*settled.latency);
      if (settled.was_unclear) {
        --tally.unclear;
        ++tally.queries;
      }
      break;
  }
}

std::optional<double> BusTally::duration_s() const {
  if (!first_at || !last_at) return std::nullopt;
  return std::max(std::chrono::duration<double>(*last_at - *first_at).count(), 0.0);
}

std::optional<double> BusTally::rate_Hz(const CommandTally& command) const {
  const auto duration = duration_s();
  if (!duration || *duration <= 0) return std::nullopt;
  const std::uint64_t counted = command.queries > 0 ? command.queries : command.replies;
  return static_cast<double>(counted) / *duration;
}

}  // namespace lk::emulator
