#pragma once

/// @file Logs in the format of candump -L and canplayer: "(1700000000.123456) vcan0
/// 141#9C00000000000000".

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "emulator/core/sim_time.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// One line of a log. Newer versions of candump append the direction: R (received) or T (sent).
struct CandumpLine {
  enum class Direction : std::uint8_t { kUnknown, kReceived, kSent };
  SimTime at{0};  // time as written, mostly since 1970
  std::string interface;
  protocol::Frame frame;
  Direction direction = Direction::kUnknown;
  int number = 0;  // line number in the log, from 1; 0: not from a log

  friend bool operator==(const CandumpLine&, const CandumpLine&) = default;
};

/// Parses the time in "(1700000000.123456)", with one to nine decimals.
std::optional<SimTime> parse_candump_stamp(std::string_view word);

/// Parses a line without its newline. Returns the line, or the problem as text for the user.
std::variant<CandumpLine, std::string> parse_candump_line(std::string_view line);

/// Parses a log and skips empty lines. Throws ConfigError with the number of a bad line.
std::vector<CandumpLine> parse_candump_log(std::string_view text, const std::string& file);

/// Returns a line without its newline. Truncates the time to microseconds, which keeps the order of
/// lines.
std::string candump_line(SimTime at, std::string_view interface, const protocol::Frame& frame,
                         CandumpLine::Direction direction = CandumpLine::Direction::kUnknown);

}  // namespace lk::emulator
