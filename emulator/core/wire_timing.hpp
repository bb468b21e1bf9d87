#pragma once

#include <cstdint>

#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Returns the duration of `bits` at `bitrate` > 0 bit/s, rounded up to a nanosecond. Exact at the
/// bit rates of CAN 2.0A, whose bit is a whole number of nanoseconds.
SimTime bits_duration(std::int64_t bits, std::int64_t bitrate);

/// Start bit, eight data bits, stop bit.
inline constexpr int kSerialBitsPerByte = 10;

/// Returns the number of control ticks up to and including `t` ≥ 0: ⌊t·f⌋, exact. Tick n is at n/f.
/// `f_Hz` is in 1..1e6.
std::int64_t ticks_until(SimTime t, std::int64_t f_Hz);
/// Returns the time of tick n ≥ 0: n/f, rounded up to a nanosecond, so `ticks_until` returns n.
SimTime time_of_tick(std::int64_t n, std::int64_t f_Hz);

}  // namespace lk::emulator
