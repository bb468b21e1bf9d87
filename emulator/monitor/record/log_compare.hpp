#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/monitor/frames/log_pairing.hpp"

namespace lk::emulator {

/// Times from query to reply.
struct Latency {
  SimTime median{0};
  SimTime most{0};
};

/// Replies to one command, in the log and from the emulator.
struct ComparedCommand {
  std::uint8_t command = 0;
  std::uint64_t queries = 0;
  std::uint64_t in_log = 0;       // replies
  std::uint64_t emulated = 0;     // replies
  std::uint64_t missing = 0;      // replies in the log but not from the emulator
  std::uint64_t extra = 0;        // replies from the emulator but not in the log
  std::uint64_t undecodable = 0;  // replies in the log that do not decode as the emulator's do
  Latency latency_in_log;
  Latency latency_emulated;
};

/// One quantity in the replies to one command.
struct ComparedValue {
  std::uint8_t command = 0;
  std::string_view name;
  std::uint64_t count = 0;  // pairs of replies
  std::uint64_t equal = 0;
  double sum = 0;      // of absolute differences
  double most = 0;     // largest absolute difference
  SimTime most_at{0};  // time of the reply in the log that has it
  int most_id = 0;     // drive of this reply

  double mean() const { return count > 0 ? sum / static_cast<double>(count) : 0; }
};

struct LogComparison {
  std::vector<ComparedCommand> commands = {};  // ascending
  std::vector<ComparedValue> values = {};      // by command, in the order of the reply
  protocol::Framing framing = protocol::Framing::kCan;
  std::uint64_t sent = 0;
  std::uint64_t ambiguous = 0;
  std::uint64_t orphans = 0;
  std::uint64_t unknown_drive_frames = 0;
};

/// Simulated time before the first frame of a log, so that filters settle (assumed).
inline constexpr SimTime kBeforeLog = std::chrono::milliseconds(100);

/// Sends the hosts' frames of the log to an emulated bus with configuration `bus`, at the times of
/// the log. Compares its replies with those in the log, quantity by quantity.
LogComparison compare_log(const std::vector<LoggedFrame>& log, const BusConfig& bus);

/// Formats the result as Markdown.
std::string comparison_text(const LogComparison& comparison);

}  // namespace lk::emulator
