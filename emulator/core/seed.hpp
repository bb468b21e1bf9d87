#pragma once

#include <cstdint>

namespace lk::emulator {

/// What draws from the bus's seed: its drives, its faults, its hosts' adapter; each has numbers of
/// its own.
enum class SeedStream : std::uint8_t {
  kNoise,
  kBootAngle,
  kFault,
  kReplyTime,
  kWire,
  kAdapter,
  kAlign
};

/// SplitMix64 (Steele, Lea, Flood 2014): neighbouring inputs give unrelated outputs.
constexpr std::uint64_t mix(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15U;
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9U;
  x = (x ^ (x >> 27U)) * 0x94D049BB133111EBU;
  return x ^ (x >> 31U);
}

/// Depends on the bus's seed and the drive's ID only, so a drive does not change with its company.
constexpr std::uint64_t stream_seed(std::uint64_t bus_seed, int id, SeedStream stream) {
  return mix(mix(bus_seed) + static_cast<std::uint64_t>(id) * 256U +
             static_cast<std::uint64_t>(stream));
}

/// [0, 1), from the upper 53 bits.
constexpr double uniform(std::uint64_t bits) { return static_cast<double>(bits >> 11U) * 0x1p-53; }

}  // namespace lk::emulator
