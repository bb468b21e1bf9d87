#include "emulator/core/wire_timing.hpp"

#include <cassert>

namespace lk::emulator {

constexpr std::int64_t kNsPerS = 1'000'000'000;

SimTime bits_duration(std::int64_t bits, std::int64_t bitrate) {
  assert(bits >= 0 && bitrate > 0);
  return SimTime{(bits * kNsPerS + bitrate - 1) / bitrate};
}

std::int64_t ticks_until(SimTime t, std::int64_t f_Hz) {
  assert(t.count() >= 0 && f_Hz > 0);
  // Split off whole seconds: t·f overflows 64 bits after 80 hours at 32 kHz.
  const std::int64_t seconds = t.count() / kNsPerS;
  const std::int64_t rest_ns = t.count() % kNsPerS;
  return seconds * f_Hz + rest_ns * f_Hz / kNsPerS;
}

SimTime time_of_tick(std::int64_t n, std::int64_t f_Hz) {
  assert(n >= 0 && f_Hz > 0);
  const std::int64_t rest = n % f_Hz;
  return SimTime{n / f_Hz * kNsPerS + (rest * kNsPerS + f_Hz - 1) / f_Hz};
}

}  // namespace lk::emulator
