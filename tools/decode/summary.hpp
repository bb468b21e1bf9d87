#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "emulator/core/sim_time.hpp"
#include "emulator/monitor/frames/conversation.hpp"

namespace lk::emulator {

/// Histogram of latencies in bounded memory. Up to 63 µs, bins are 1 µs wide; above, 1/32 of an
/// octave. The error of a quantile is thus at most 1.6 %. Minimum and maximum are exact.
class LatencyHistogram {
 public:
  /// Ignores negative times.
  void add(SimTime latency);
  std::uint64_t count() const { return count_; }
  SimTime min() const { return min_; }
  SimTime max() const { return max_; }
  /// Returns the quantile `share`, 0..1, by nearest rank; 0 without latencies.
  SimTime quantile(double share) const;

 private:
  std::vector<std::uint64_t> counts_;  // about 400 bins for 100 ms
  std::uint64_t count_ = 0;
  SimTime min_{0};
  SimTime max_{0};
};

struct CommandTally {
  std::uint64_t queries = 0;
  std::uint64_t replies = 0;
  std::uint64_t unclear = 0;     // frames that may be a query or a reply
  std::uint64_t unanswered = 0;  // queries that surely got no reply
  std::uint64_t open = 0;        // queries that may have got a reply
  std::uint64_t orphans = 0;     // replies without a query in the log
  LatencyHistogram latency;
};

struct ErrorTally {
  std::uint64_t replies = 0;
  std::optional<SimTime> first_at;
};

/// Counters of one interface. Use bounded memory.
struct BusTally {
  std::uint64_t frames = 0;
  protocol::Framing framing = protocol::Framing::kCan;
  std::optional<SimTime> first_at, last_at;
  // Key: drive (0: several), and command byte or identifier.
  std::map<std::pair<int, std::uint32_t>, CommandTally> commands;
  std::map<std::pair<int, std::string_view>, ErrorTally> errors;
  std::map<std::string_view, std::uint64_t> meaningless;  // frames without meaning, by reason
  std::uint64_t of_newer_firmware = 0;  // of `meaningless`: another generation has the command

  void count(const FrameInfo& info, const FrameWords& words, const std::optional<SimTime>& at);
  void count(const QueryOutcome& settled);
  /// Returns the time from the first to the last frame; empty without time stamps.
  std::optional<double> duration_s() const;
  /// Returns queries per second (without queries: replies per second); empty without a duration.
  std::optional<double> rate_Hz(const CommandTally& command) const;
};

}  // namespace lk::emulator
