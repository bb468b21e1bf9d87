#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// A frame of a log, with its direction if the log has it.
struct LoggedFrame {
  TimedFrame timed;
  std::optional<bool> from_host;
  int line = 0;  // line number in the log, from 1; 0: none
};

/// A query to one drive and its reply. A frame for several drives is one query to each drive that
/// answers it.
struct Exchange {
  int id = 1;
  std::size_t query = 0;     // index in PairedLog::sent
  std::uint8_t command = 0;  // DATA[0] of the reply
  std::optional<TimedFrame> reply;
};

/// A log with queries and replies separated.
struct PairedLog {
  std::vector<TimedFrame> sent;     // from hosts and other devices
  std::vector<Exchange> exchanges;  // in the order of their queries
  std::uint64_t ambiguous = 0;      // frames that may have the other role
  std::uint64_t orphans = 0;        // replies without a query in the log
  std::uint64_t strangers = 0;      // frames of drives that are not in the robot; ignored
};

/// Time-out of a query (assumed; a drive answers within 1 ms).
inline constexpr SimTime kLongestReply = std::chrono::milliseconds(100);

/// Separates queries and replies. Pre: `log` is ordered by time. Uses separate reply identifiers or
/// directions if the log has them. Otherwise a frame is a reply if it can answer a pending query of
/// its drive (rules: docs/record.md).
PairedLog pair_log(const std::vector<LoggedFrame>& log, const BusConfig& bus);

}  // namespace lk::emulator
