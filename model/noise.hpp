#pragma once

/// @file Repeatable sensor noise: one generator a drive, the same bits on every machine.

#include <bit>

#include "model/real.hpp"

namespace lk::model {

/// Generator states of one drive (`Store` = double) or of a block.
template <class Store>
struct NoiseState {
  alignas(64) std::array<std::uint64_t, kLanes> word{1, 1, 1, 1, 1, 1, 1, 1};
};
template <>
struct NoiseState<double> {
  std::array<std::uint64_t, 1> word{1};
};

/// Non-zero generator state from any seed (splitmix64, Steele et al. 2014).
constexpr std::uint64_t noise_seed(std::uint64_t seed) {
  seed += 0x9E3779B97F4A7C15U;
  seed = (seed ^ (seed >> 30U)) * 0xBF58476D1CE4E5B9U;
  seed = (seed ^ (seed >> 27U)) * 0x94D049BB133111EBU;
  seed ^= seed >> 31U;
  return seed == 0 ? 1 : seed;
}

inline namespace LKEMU_ISA {

/// One deviate of mean 0 and variance 1: xorshift64 (Marsaglia 2003), its four 16-bit quarters
/// added up (Irwin–Hall, n = 4: bounded by ±3.46, kurtosis 2.7), so that no logarithm is needed.
inline double normal_deviate(std::uint64_t& word) {
  word ^= word << 13U;
  word ^= word >> 7U;
  word ^= word << 17U;
  constexpr std::uint64_t kQuarters = 0x0000FFFF0000FFFFU;
  std::uint64_t sum = (word & kQuarters) + ((word >> 16U) & kQuarters);
  sum = (sum & 0x1FFFFU) + (sum >> 32U);
  // The sum becomes the low mantissa bits of 2^52; taking 2^52 and the mean (4·65535/2) off leaves
  // it centred. Standard deviation: sqrt(4·(65536² − 1)/12) = 37837.2.
  const double centred = std::bit_cast<double>(sum | 0x4330000000000000U) - (0x1p52 + 131070.0);
  return centred * (1.0 / 37837.227);
}

/// Deviates of as many drives as `Real` holds, `word` pointing at the generator of the first.
template <class Real>
inline Real normal(std::uint64_t* word) {
  if constexpr (kSizeOf<Real> == 1) {
    return normal_deviate(*word);
  } else {
    alignas(64) std::array<double, kSizeOf<Real>> deviates;
    for (std::size_t n = 0; n < kSizeOf<Real>; ++n) {
      deviates[n] = normal_deviate(word[n]);
    }
    Real result;
    result.copy_from(deviates.data(), std::experimental::vector_aligned);
    return result;
  }
}

}  // namespace LKEMU_ISA
}  // namespace lk::model
