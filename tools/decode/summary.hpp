#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "emulator/frames/conversation.hpp"
#include "tools/decode/latency_histogram.hpp"

namespace lk::emulator {

struct CommandTally {
  std::uint64_t queries = 0;
  std::uint64_t replies = 0;
  std::uint64_t unclear = 0;     // query or reply, nobody knows
  std::uint64_t unanswered = 0;  // queries that surely got no reply
  std::uint64_t open = 0;        // those of which that is not known
  std::uint64_t orphans = 0;     // replies to a query that is not there
  LatencyHistogram latency;
};

struct ErrorTally {
  std::uint64_t replies = 0;
  std::optional<SimTime> first_at;
};

/// What was on one interface. Its size does not grow with time.
struct BusTally {
  std::uint64_t frames = 0;
  protocol::Framing framing = protocol::Framing::kCan;
  std::optional<SimTime> first_at, last_at;
  // By drive, 0 for several, and command byte or identifier.
  std::map<std::pair<int, std::uint32_t>, CommandTally> commands;
  std::map<std::pair<int, std::string_view>, ErrorTally> errors;
  std::map<std::string_view, std::uint64_t> meaningless;  // frames, by why
  std::uint64_t of_newer_firmware = 0;  // among them: another generation knows the command

  void count(const Told& told, const FrameWords& words, const std::optional<SimTime>& at);
  void count(const Settled& settled);
  /// Between the first and the last frame; none without stamps.
  std::optional<double> duration_s() const;
  /// Queries a second, or replies where there are no queries; none in no time.
  std::optional<double> rate_Hz(const CommandTally& command) const;
};

}  // namespace lk::emulator
