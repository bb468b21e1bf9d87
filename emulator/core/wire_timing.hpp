#pragma once

/// @file Durations on the wire, times of control ticks, and timing of the adapter between hosts and
/// wire (docs/reference/configuration.md).

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Returns the duration of `bits` at `bitrate` bit/s, rounded up to a nanosecond; 0 at bit rate 0.
/// Exact at the bit rates of CAN 2.0A, whose bit is a whole number of nanoseconds.
SimTime bits_duration(std::int64_t bits, std::int64_t bitrate);

/// Start bit, eight data bits, stop bit.
inline constexpr int kSerialBitsPerByte = 10;

/// Returns the number of control ticks up to and including `t` ≥ 0: ⌊t·f⌋, exact. Tick n is at n/f.
/// `f_Hz` is in 1..1e6.
std::int64_t ticks_until(SimTime t, std::int64_t f_Hz);
/// Returns the time of tick n ≥ 0: n/f, rounded up to a nanosecond, so `ticks_until` returns n.
SimTime time_of_tick(std::int64_t n, std::int64_t f_Hz);

/// Time without a frame from the wire after which a write of a host may stall (assumed).
inline constexpr SimTime kAdapterSilence = std::chrono::milliseconds(10);
/// Capacity, in frames, of the queue to a host if AdapterTimes::depth is 0 (assumed: 60 ms or more
/// of a full wire).
inline constexpr std::size_t kMaxInAdapter = 512;

/// Delays and limits that an adapter adds to the wire; all 0: no adapter. `add` combines several
/// adapters.
struct AdapterTimes {
  // Latency of each frame to the wire (tx) and to the host (rx), plus uniform jitter within
  // ±jitter_us, plus tail_us for some frames. A negative sum counts as 0.
  double tx_us = 0, rx_us = 0, jitter_us = 0, tail_us = 0;
  double tail_probability = 0;  // 0..1, per frame
  double frame_us = 0;          // line time of a frame; each direction carries one at a time
  // Frames reach the host at multiples of this time, or once `batch_most` frames (RS-485: bytes)
  // wait; 0: at once.
  double batch_us = 0;
  std::size_t batch_most = 0;
  // Capacity of the queue to the host, frames (RS-485: bytes); 0: kMaxInAdapter frames. If full,
  // the newest frame is lost, and an error frame may report it.
  std::size_t depth = 0;
  bool reports_overrun = true;
  // Frames of hosts that wait for the wire, CAN; 0: as many as the hosts' queue holds.
  std::size_t tx_depth = 0;
  // After kAdapterSilence without a frame from the wire, every `stall_every`-th write of the host
  // blocks it for `stall_us`. 0: no stalls.
  int stall_every = 0;
  double stall_us = 0;

  /// Returns the largest delay of a single query and its reply, without stalls.
  SimTime worst_round_trip() const;
  bool any() const { return !(*this == AdapterTimes{}); }
  friend bool operator==(const AdapterTimes&, const AdapterTimes&) = default;
};
AdapterTimes add(const AdapterTimes& one, const AdapterTimes& other);

/// Timing of an adapter type that hosts use.
struct AdapterProfile {
  std::string_view name;  // "ch348"
  AdapterTimes times;
  std::string_view source;  // of the numbers in `times`
};
/// All profiles; the first one adds no times.
std::span<const AdapterProfile> adapter_profiles();
/// Returns the profile of this name; null if unknown.
const AdapterProfile* find_adapter(std::string_view name);

}  // namespace lk::emulator
