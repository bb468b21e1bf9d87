#pragma once

#include <cstdint>

#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// How long `bits` take at `bitrate` bit/s, > 0; rounded up to the next nanosecond. Exact at the
/// bit rates of CAN 2.0A, whose bit is a whole number of nanoseconds.
SimTime bits_duration(std::int64_t bits, std::int64_t bitrate);

/// Of a byte on RS-485: start, eight, stop.
inline constexpr int kSerialBitsPerByte = 10;

/// The number of control ticks up to and including `t` ≥ 0, tick n being at n/f: ⌊t·f⌋, exactly.
/// `f_Hz` in 1..1e6.
std::int64_t ticks_until(SimTime t, std::int64_t f_Hz);
/// When tick n ≥ 0 is: n/f, rounded up to the next nanosecond, so that `ticks_until` gives n again.
SimTime time_of_tick(std::int64_t n, std::int64_t f_Hz);

}  // namespace lk::emulator
