#include "emulator/config/candump_log.hpp"

#include <cstdint>

#include "emulator/config/config_error.hpp"
#include "emulator/core/frame_text.hpp"
#include "emulator/core/text.hpp"

namespace lk::emulator {
namespace {

constexpr std::uint64_t kNanos = 1'000'000'000;
constexpr std::uint64_t kLatest_s = INT64_MAX / kNanos - 1;

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r'; }

/// Removes the next word from `rest` and returns it; empty at the end.
std::string_view next_word(std::string_view& rest) {
  while (!rest.empty() && is_space(rest.front())) rest.remove_prefix(1);
  std::size_t length = 0;
  while (length < rest.size() && !is_space(rest[length])) ++length;
  const std::string_view word = rest.substr(0, length);
  rest.remove_prefix(length);
  return word;
}

void add_padded(std::string& text, std::int64_t value, std::size_t width) {
  const std::string number = std::to_string(value);
  if (number.size() < width) text.append(width - number.size(), '0');
  text += number;
}

}  // namespace

std::optional<SimTime> parse_candump_stamp(std::string_view word) {
  if (word.size() < 5 || word.front() != '(' || word.back() != ')') return std::nullopt;
  word = word.substr(1, word.size() - 2);
  const std::size_t point = word.find('.');
  if (point == std::string_view::npos) return std::nullopt;
  const std::string_view decimals = word.substr(point + 1);
  const auto seconds = number_of(word.substr(0, point), 10, kLatest_s);
  auto fraction = number_of(decimals, 10, kNanos - 1);
  if (!seconds || !fraction || decimals.size() > 9) return std::nullopt;
  for (std::size_t n = decimals.size(); n < 9; ++n) *fraction *= 10;
  return SimTime(*seconds * kNanos + *fraction);
}

std::variant<CandumpLine, std::string> parse_candump_line(std::string_view line) {
  const std::string_view stamp = next_word(line);
  const std::string_view interface = next_word(line);
  const std::string_view frame = next_word(line);
  const std::string_view direction = next_word(line);
  CandumpLine out;
  if (const auto at = parse_candump_stamp(stamp)) {
    out.at = *at;
  } else {
    return "\"" + std::string(stamp) +
           "\" is not a time stamp; a line of candump -L is like "
           "(1700000000.123456) vcan0 141#9C00000000000000";
  }
  if (frame.empty()) return std::string("ends before its frame");
  out.interface = interface;
  auto parsed = parse_frame(frame);
  if (auto* problem = std::get_if<std::string>(&parsed)) return std::move(*problem);
  out.frame = std::get<protocol::Frame>(parsed);
  if (direction == "R") {
    out.direction = CandumpLine::Direction::kReceived;
  } else if (direction == "T") {
    out.direction = CandumpLine::Direction::kSent;
  } else if (!direction.empty()) {
    return "\"" + std::string(direction) + "\" behind the frame is neither R nor T";
  }
  if (!next_word(line).empty()) return std::string("has something after its frame");
  return out;
}

std::vector<CandumpLine> parse_candump_log(std::string_view text, const std::string& file) {
  std::vector<CandumpLine> lines;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    std::string_view rest = line;
    if (next_word(rest).empty()) continue;
    auto parsed = parse_candump_line(line);
    if (const auto* problem = std::get_if<std::string>(&parsed)) {
      throw ConfigError(file, number, "", *problem);
    }
    lines.push_back(std::move(std::get<CandumpLine>(parsed)));
    lines.back().number = number;
  }
  return lines;
}

std::string candump_line(SimTime at, std::string_view interface, const protocol::Frame& frame,
                         CandumpLine::Direction direction) {
  constexpr std::int64_t kMicros = 1'000'000;
  const std::int64_t at_us = at.count() / 1000;
  std::string text = "(";
  add_padded(text, at_us / kMicros, 10);
  text += '.';
  add_padded(text, at_us % kMicros, 6);
  text.append(") ").append(interface).append(" ").append(frame_text(frame));
  // candump appends a digit of flags to a CAN FD frame.
  if (frame.kind == protocol::FrameKind::kFd) text += '0';
  if (direction == CandumpLine::Direction::kReceived) text += " R";
  if (direction == CandumpLine::Direction::kSent) text += " T";
  return text;
}

}  // namespace lk::emulator
