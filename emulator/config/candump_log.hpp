#pragma once

/// @file Logs as candump -L writes them and canplayer reads them:
/// "(1700000000.123456) vcan0 141#9C00000000000000".

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "emulator/core/sim_time.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// One line. Newer candumps say at its end whether the frame was received or sent.
struct CandumpLine {
  enum class Direction : std::uint8_t { kUnsaid, kReceived, kSent };
  SimTime at{0};  // as it stands there: since 1970 mostly
  std::string interface;
  protocol::Frame frame;
  Direction direction = Direction::kUnsaid;
  int number = 0;  // of the line in its log, from 1; 0: of none

  friend bool operator==(const CandumpLine&, const CandumpLine&) = default;
};

/// The time in "(1700000000.123456)", with one to nine decimals.
std::optional<SimTime> parse_candump_stamp(std::string_view word);

/// A line without its end, or what is wrong with it, for a person.
std::variant<CandumpLine, std::string> parse_candump_line(std::string_view line);

/// All lines of a log; empty ones do not count. Throws ConfigError with the line of a bad one.
std::vector<CandumpLine> parse_candump_log(std::string_view text, const std::string& file);

/// A line, without its end; times are cut to whole microseconds, so that their order stays.
std::string candump_line(SimTime at, std::string_view interface, const protocol::Frame& frame,
                         CandumpLine::Direction direction = CandumpLine::Direction::kUnsaid);

}  // namespace lk::emulator
