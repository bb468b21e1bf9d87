#pragma once

/// @file What adapters between hosts and their wire do, as numbers (docs/configuration.md).

#include <chrono>
#include <cstddef>
#include <span>
#include <string_view>

#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Before a write of a host that sends and then reads the answer is called unanswered (assumed).
inline constexpr SimTime kAdapterSilence = std::chrono::milliseconds(10);
/// Frames that wait for a host at most, without a `depth` (assumed: 60 ms and more of a full wire).
inline constexpr std::size_t kMostInAdapter = 512;

/// What an adapter adds to the wire's own times. Several add up (`add`). All 0: nothing.
struct AdapterTimes {
  // Latency of each frame: to the wire, to the host, evenly to either side of that, and now and
  // then so much more. Never below 0.
  double tx_us = 0, rx_us = 0, jitter_us = 0, tail_us = 0;
  double tail_probability = 0;  // 0..1, of each frame
  double frame_us = 0;          // a frame takes its line so long, either way, one after the other
  // What comes from the wire reaches the host at multiples of this, or at once when so much waits;
  // 0: at once.
  double batch_us = 0;
  std::size_t batch_most = 0;
  // So much may wait for the host; the newest beyond is lost, and the host is told or not. 0: as
  // much as kMostInAdapter.
  std::size_t depth = 0;
  bool reports_overrun = true;
  // While nothing has come from the wire for kAdapterSilence, each of so many writes blocks
  // the host so long.
  int stall_every = 0;
  double stall_us = 0;

  /// The most that a lone query and its reply take longer, stalls aside.
  SimTime worst_round_trip() const;
  bool any() const { return !(*this == AdapterTimes{}); }
  friend bool operator==(const AdapterTimes&, const AdapterTimes&) = default;
};
AdapterTimes add(const AdapterTimes& one, const AdapterTimes& other);

/// An adapter that hosts are seen to use.
struct AdapterProfile {
  std::string_view name;  // "ch348"
  AdapterTimes times;
  std::string_view source;  // of the numbers
};
/// All of them; the first is none.
std::span<const AdapterProfile> adapter_profiles();
/// Null when there is none of this name.
const AdapterProfile* find_adapter(std::string_view name);

}  // namespace lk::emulator
