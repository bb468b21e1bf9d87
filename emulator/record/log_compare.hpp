#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/frames/log_pairing.hpp"

namespace lk::emulator {

/// How long something took: of a drive's replies, from query to reply.
struct Latency {
  SimTime median{0};
  SimTime most{0};
};

/// The replies to one command, in the log and from the emulator.
struct ComparedCommand {
  std::uint8_t command = 0;
  std::uint64_t queries = 0;
  std::uint64_t in_log = 0;       // replies
  std::uint64_t emulated = 0;     // replies
  std::uint64_t missing = 0;      // the log has one, the emulator gave none
  std::uint64_t extra = 0;        // the other way round
  std::uint64_t undecodable = 0;  // of the log: no reply that such a drive gives
  Latency latency_in_log;
  Latency latency_emulated;
};

/// One quantity of the replies to one command.
struct ComparedValue {
  std::uint8_t command = 0;
  std::string_view name;
  std::uint64_t count = 0;  // pairs of replies
  std::uint64_t equal = 0;
  double sum = 0;  // of the absolute differences
  double most = 0;
  SimTime most_at{0};  // as the log counts time
  int most_id = 0;

  double mean() const { return count > 0 ? sum / static_cast<double>(count) : 0; }
};

struct LogComparison {
  std::vector<ComparedCommand> commands;  // ascending
  std::vector<ComparedValue> values;      // by command, as the replies have them
  protocol::Framing framing = protocol::Framing::kCan;
  std::uint64_t sent = 0;
  std::uint64_t ambiguous = 0;
  std::uint64_t orphans = 0;
  std::uint64_t strangers = 0;
};

/// What passes on the bus before the first frame of a log; assumed, for filters to settle.
inline constexpr SimTime kBeforeLog = std::chrono::milliseconds(100);

/// Sends what the log's hosts sent to a bus of that configuration, at the times of the log, and
/// compares the replies quantity by quantity.
LogComparison compare_log(const std::vector<LoggedFrame>& log, const BusConfig& bus);

/// For people, in Markdown.
std::string comparison_text(const LogComparison& comparison);

}  // namespace lk::emulator
