#pragma once

#include <cstdint>

namespace lk::emulator {

/// Users of the bus seed: drives, faults, adapter. Each has a separate sequence of numbers.
enum class SeedStream : std::uint8_t {
  kNoise,
  kBootAngle,
  kFault,
  kReplyTime,
  kWire,
  kAdapter,
  kAlign,
  kSpecimen
};

/// SplitMix64 (Steele, Lea, Flood 2014): neighbouring inputs give unrelated outputs.
constexpr std::uint64_t mix(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15U;
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9U;
  x = (x ^ (x >> 27U)) * 0x94D049BB133111EBU;
  return x ^ (x >> 31U);
}

/// Returns the seed of one stream of a drive. It does not depend on the other drives of the bus.
constexpr std::uint64_t stream_seed(std::uint64_t bus_seed, int id, SeedStream stream) {
  return mix(mix(bus_seed) + static_cast<std::uint64_t>(id) * 256U +
             static_cast<std::uint64_t>(stream));
}

/// Maps the upper 53 bits to [0, 1).
constexpr double uniform(std::uint64_t bits) { return static_cast<double>(bits >> 11U) * 0x1p-53; }

}  // namespace lk::emulator
