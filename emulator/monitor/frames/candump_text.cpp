#include "emulator/monitor/frames/candump_text.hpp"

#include <algorithm>
#include <chrono>

#include "emulator/core/frame_text.hpp"
#include "emulator/core/text.hpp"

namespace lk::emulator {
namespace {

using Direction = CandumpLine::Direction;

constexpr std::size_t kLongestBus = 100;  // in characters; names of buses may be URIs
constexpr std::size_t kMaxFdBytes = 64;

/// Removes the next word from `rest` and returns it; empty at the end.
std::string_view next_word(std::string_view& rest) {
  rest = trimmed(rest);
  const std::string_view word = rest.substr(0, rest.find(' '));
  rest.remove_prefix(word.size());
  return word;
}

/// Removes colour codes: escape, bracket, digits and semicolons, m.
std::string without_colours(std::string_view line) {
  std::string plain;
  for (std::size_t n = 0; n < line.size(); ++n) {
    if (line.substr(n, 2) == "\x1b[") {
      const std::size_t end = line.find_first_not_of("0123456789;", n + 2);
      if (end != std::string_view::npos && line[end] == 'm') {
        n = end;
        continue;
      }
    }
    plain += line[n];
  }
  return plain;
}

/// Parses "(2026-11-21 23:33:28.834873)" as UTC.
std::optional<SimTime> parse_date(std::string_view text) {
  constexpr std::string_view kForm = "(0000-00-00 00:00:00";
  for (std::size_t n = 0; n < kForm.size(); ++n) {
    const bool is_digit = n < text.size() && text[n] >= '0' && text[n] <= '9';
    if (kForm[n] == '0' ? !is_digit : !text.substr(n).starts_with(kForm[n])) return std::nullopt;
  }
  const auto part = [text](std::size_t first, std::size_t width) {
    return static_cast<int>(*number_of(text.substr(first, width), 10, 9999));
  };
  const int year = part(1, 4);
  const std::chrono::year_month_day date{std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(part(6, 2))),
                                         std::chrono::day(static_cast<unsigned>(part(9, 2)))};
  const auto second = parse_candump_stamp("(" + std::string(text.substr(18)));
  if (text.size() < 24 || !date.ok() || year < 1970 || year > 2200 || part(12, 2) > 23 ||
      part(15, 2) > 59 || !second || *second > std::chrono::seconds(61)) {
    return std::nullopt;
  }
  return SimTime(std::chrono::sys_days(date).time_since_epoch()) + std::chrono::hours(part(12, 2)) +
         std::chrono::minutes(part(15, 2)) + *second;
}

/// Moves a stamp from the front of `rest` to `out`. Returns false if there is a stamp, but not in a
/// form of candump.
bool take_stamp(std::string_view& rest, PrintedFrame& out) {
  if (!rest.starts_with('(')) return true;
  const std::size_t length = std::min(rest.find(')'), rest.size() - 1) + 1;
  const std::string_view text = rest.substr(0, length);
  rest.remove_prefix(length);
  auto at = parse_candump_stamp(text);
  // "(000.041064)": seconds of -t d and -t z have three digits, those of a date ten.
  out.may_be_step = at && text.find('.') <= 8;
  if (!at) at = parse_date(text);
  out.has_stamp = at.has_value();
  out.line.at = at.value_or(SimTime{0});
  return at.has_value();
}

std::string in_quotes(std::string_view text) {
  constexpr std::size_t kMax = 40;
  return "\"" + std::string(text.substr(0, kMax)) + (text.size() > kMax ? "..." : "") + "\"";
}

/// Moves a direction such as "TX - -" or "RX B E" (-x) from the front of `rest` to `line`.
void take_direction(std::string_view& rest, CandumpLine& line) {
  std::string_view after = rest;
  const std::string_view word = next_word(after);
  if (word != "TX" && word != "RX") return;
  line.direction = word == "TX" ? Direction::kSent : Direction::kReceived;
  rest = after;
  for (std::string_view flag = next_word(after); flag == "-" || flag == "B" || flag == "E";
       flag = next_word(after)) {
    rest = after;
  }
}

/// Parses "[8]", "[08]" (CAN FD), or "{B}" (-8), which is a DLC above 8 with eight bytes.
std::optional<std::size_t> read_length(std::string_view word, bool& fd) {
  if (word.size() == 3 && word.front() == '{' && word.back() == '}') return 8;
  if (word.size() < 3 || word.front() != '[' || word.back() != ']') return std::nullopt;
  fd = word.size() == 4;
  return number_of(word.substr(1, word.size() - 2), 10, fd ? kMaxFdBytes : 8);
}

/// Parses terminal output after the stamp: "vcan0  TX - -  141   [8]  9C 00 …". Returns an error
/// text; empty without an error.
std::string read_shown(std::string_view rest, PrintedFrame& out) {
  out.line.interface = next_word(rest);
  take_direction(rest, out.line);
  const std::string_view id = next_word(rest);
  const std::string_view length_word = next_word(rest);
  if (length_word.empty()) return "ends before its frame";
  bool fd = false;
  const auto length = read_length(length_word, fd);
  if (!length) return in_quotes(length_word) + " is not the length of a frame";
  std::string text(id);
  text += '#';
  rest = trimmed(rest);
  if (rest.starts_with("remote request")) {
    rest.remove_prefix(std::string_view("remote request").size());
    text += "R" + std::to_string(*length);
  } else {
    if (fd) text += "#0";
    for (std::size_t n = 0; n < *length; ++n) {
      const std::string_view byte = next_word(rest);
      if (byte.size() != 2) return in_quotes(byte) + " is not a byte of two hexadecimal digits";
      text += byte;
    }
  }
  rest = trimmed(rest);
  if (rest.starts_with("ERRORFRAME")) rest = trimmed(rest.substr(10));
  if (!rest.empty() && !rest.starts_with('\'')) return "has something after its frame";  // -a: '
  auto parsed = parse_frame(text);
  if (auto* problem = std::get_if<std::string>(&parsed)) return std::move(*problem);
  out.line.frame = std::get<protocol::Frame>(parsed);
  return "";
}

/// Returns true for a line of a log: "(1700000000.123456) vcan0 141#9C00000000000000 T".
bool is_log_line(std::string_view line) {
  next_word(line);
  next_word(line);
  return next_word(line).find('#') != std::string_view::npos;
}

std::string read_line(std::string_view line, PrintedFrame& out) {
  if (is_log_line(line)) {
    auto parsed = parse_candump_line(line);
    if (auto* problem = std::get_if<std::string>(&parsed)) return std::move(*problem);
    out.line = std::get<CandumpLine>(std::move(parsed));
    out.has_stamp = true;
  } else {
    if (!take_stamp(line, out)) return "has no time stamp of candump in its brackets";
    std::string problem = read_shown(line, out);
    if (!problem.empty()) return problem;
  }
  const bool named = out.line.interface.size() <= kLongestBus;
  return named ? "" : in_quotes(out.line.interface) + " is too long a name for a bus";
}

}  // namespace

std::variant<PrintedFrame, NoFrame, std::string> parse_candump_text(std::string_view line) {
  if (line.ends_with('\r')) line.remove_suffix(1);
  if (line.size() > kLongestCandumpLine) return "is longer than candump's lines";
  if (line.starts_with('\t')) return NoFrame{};
  const std::string plain = without_colours(line);
  for (const char c : plain) {
    if (c < 0x20 || c > 0x7E) return "has characters that candump does not print";
  }
  const std::string_view words = trimmed(plain);
  if (words.empty()) return NoFrame{};
  PrintedFrame frame;
  std::string problem = read_line(words, frame);
  if (!problem.empty()) return problem.substr(0, 200);
  return frame;
}

std::optional<bool> from_host(CandumpLine::Direction direction) {
  if (direction == Direction::kUnknown) return std::nullopt;
  return direction == Direction::kSent;
}

std::optional<SimTime> StampReader::time_of(const PrintedFrame& frame) {
  if (!frame.has_stamp) return std::nullopt;
  if (!frame.may_be_step) return frame.line.at;
  sum_ += std::min(frame.line.at, SimTime::max() - sum_);
  if (!steps_) {
    SimTime& last = last_.try_emplace(frame.line.interface, SimTime{0}).first->second;
    steps_ = frame.line.at < last;
    last = frame.line.at;
  }
  return steps_ ? sum_ : frame.line.at;
}

}  // namespace lk::emulator
