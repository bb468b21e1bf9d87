#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// A frame of a log, and what the log says of its direction, if it does.
struct LoggedFrame {
  TimedFrame timed;
  std::optional<bool> from_host;
  int line = 0;  // in the log, from 1; 0: in none
};

/// A query to one drive and the reply to it. A frame for several drives is one query to each that
/// answers it.
struct Exchange {
  int id = 1;
  std::size_t query = 0;     // its place among PairedLog::sent
  std::uint8_t command = 0;  // DATA[0] that the reply has
  std::optional<TimedFrame> reply;
};

/// A log of a bus, with queries and replies told apart.
struct PairedLog {
  std::vector<TimedFrame> sent;     // by hosts, and by whoever is no drive of the robot
  std::vector<Exchange> exchanges;  // in the order of their queries
  std::uint64_t ambiguous = 0;      // frames that could have been the other thing as well
  std::uint64_t orphans = 0;        // replies to nothing in the log
  std::uint64_t strangers = 0;      // frames of drives that the robot does not have: left out
};

/// A query that got no reply within this time does not get one any more; assumed, a drive answers
/// within 1 ms.
inline constexpr SimTime kLongestReply = std::chrono::milliseconds(100);

/// Tells the queries of a log from the replies, in ascending order of time. Identifiers tell where
/// replies have their own, and so does the direction where a log has both. Else a frame is a reply
/// when a query of its drive waits to which it can be one (docs/record.md has the rules).
PairedLog pair_log(const std::vector<LoggedFrame>& log, const BusConfig& bus);

}  // namespace lk::emulator
