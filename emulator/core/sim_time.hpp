#pragma once

#include <chrono>
#include <cstdint>

#include "protocol/frame.hpp"

namespace lk::emulator {

/// Simulated time since the bus was powered on: an integer number of nanoseconds. Never read from a
/// clock in here; the shell decides how it relates to wall time.
using SimTime = std::chrono::nanoseconds;

/// The longest time that can be asked for, about three years: sums of such times fit.
inline constexpr SimTime kLongestTime = std::chrono::seconds(100'000'000);

/// A frame and an instant. Of a host's frame: when the host put it on its interface. Of a drive's:
/// when its last bit was on the bus; where hosts have an adapter, when that hands it over.
struct TimedFrame {
  SimTime at{0};
  protocol::Frame frame;
  std::uint64_t after_rom_write = 0;  // of a drive's: the RomWrite it acknowledges; 0 = none
  int said_by = 0;    // of a drive's: its ID, when the identifier does not tell; else 0
  bool echo = false;  // no drive's: the host's own, which it reads
  // Of a host's: the number by which its port knows it; other hosts get to hear the frame. 0: the
  // medium has told them already.
  std::uint32_t sender = 0;

  friend bool operator==(const TimedFrame&, const TimedFrame&) = default;
};

}  // namespace lk::emulator
