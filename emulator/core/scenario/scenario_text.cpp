#include "emulator/core/scenario/scenario_text.hpp"

#include <charconv>
#include <cmath>
#include <cstdint>

namespace lk::emulator {
namespace {

std::string range_text(const Range& range) {
  if (std::isinf(range.min)) return "at most " + number_text(range.max);
  if (std::isinf(range.max)) return "at least " + number_text(range.min);
  return number_text(range.min) + " to " + number_text(range.max);
}

std::string byte_text(std::uint8_t byte) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  return std::string("0x") + kDigits[byte >> 4U] + kDigits[byte & 0xFU];
}

std::string error_text(const WhichError& error) {
  return error.one ? std::string(error_word(*error.one)) : "any";
}

std::string count_text(const Replies& replies) {
  const std::string min = std::to_string(replies.min_count);
  const std::string max = std::to_string(replies.max_count);
  const std::string noun = replies.command ? " to " + byte_text(*replies.command) : "";
  if (replies.max_count == 0) return "no reply" + noun;
  if (replies.max_count == std::numeric_limits<std::uint64_t>::max()) {
    return replies.min_count <= 1 ? "a reply" + noun : "at least " + min + " replies" + noun;
  }
  if (replies.min_count == replies.max_count) {
    return min + (replies.min_count == 1 ? " reply" : " replies") + noun;
  }
  return min + " to " + max + " replies" + noun;
}

std::string replies_text(const Replies& replies) {
  std::string text = count_text(replies);
  if (replies.error) text += " with error " + error_text(*replies.error);
  if (!replies.field.empty()) {
    text += " with " + std::string(replies.field) + ' ' + range_text(replies.range);
  }
  if (replies.age) text += ", " + range_text(*replies.age) + " ms after the query";
  return text;
}

std::string what_text(const Expectation& expectation) {
  if (const auto* within = std::get_if<SignalWithin>(&expectation.what)) {
    return std::string(within->signal->name) + ' ' + range_text(within->range);
  }
  if (const auto* error = std::get_if<ErrorIs>(&expectation.what)) {
    return "error " + error_text(error->error) + (error->set ? " set" : " not set");
  }
  if (const auto* state = std::get_if<StateIs>(&expectation.what)) return state_word(state->state);
  if (const auto* answered = std::get_if<Answered>(&expectation.what)) {
    const std::string what = answered->command ? " " + byte_text(*answered->command) : "";
    return "each query" + what + " answered within " + time_text(answered->within);
  }
  return replies_text(std::get<Replies>(expectation.what));
}

std::string when_text(const Period& when) {
  switch (when.kind) {
    case Period::Kind::kAt:
      return " at " + time_text(when.to);
    case Period::Kind::kBy:
      return (when.from > SimTime{0} ? " from " + time_text(when.from) : "") + " by " +
             time_text(when.to);
    case Period::Kind::kThroughout:
      return " from " + time_text(when.from) + " to " + time_text(when.to);
  }
  return "";
}

}  // namespace

std::string number_text(double value) {
  char buffer[32];
  constexpr int kFigures = 6;
  const auto [end, error] =
      std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::general, kFigures);
  return error == std::errc() ? std::string(buffer, end) : "?";
}

std::string state_word(RunState state) {
  switch (state) {
    case RunState::kOff:
      return "off";
    case RunState::kStopped:
      return "stopped";
    case RunState::kRunning:
      return "running";
  }
  return "";
}

std::string unasked_text(const WorstMotion& worst) {
  const UnaskedMotion& motion = worst.motion;
  const std::string why = motion.unread    ? "no angle received since "
                          : motion.to_zero ? "first target of 0 since "
                                           : "wrapped target after ";
  return worst.bus + " drive " + std::to_string(worst.id) + " turned by " +
         number_text(motion.deg) + "° (output), at up to " + number_text(motion.dps) + " dps, " +
         number_text(motion.J) + " J, from " + time_text(motion.from) + ": " + why +
         std::string(event_text(motion.event).en);
}

std::string expectation_text(const Expectation& expectation, const std::string& interface) {
  const auto* const within = std::get_if<SignalWithin>(&expectation.what);
  const std::string text = what_text(expectation) + when_text(expectation.when);
  if (within != nullptr && within->signal->is_of_body()) return text;
  return interface + " drive " + std::to_string(expectation.id) + ": " + text;
}

}  // namespace lk::emulator
