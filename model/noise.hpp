#pragma once

/// @file Repeatable sensor noise: one generator per drive, with the same bits on every machine.

#include "model/real.hpp"
#include "model/rounding.hpp"
#include "model/stored_real.hpp"

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

/// Returns a non-zero generator state for any seed (splitmix64, Steele et al. 2014).
constexpr std::uint64_t noise_seed(std::uint64_t seed) {
  seed += 0x9E3779B97F4A7C15U;
  seed = (seed ^ (seed >> 30U)) * 0xBF58476D1CE4E5B9U;
  seed = (seed ^ (seed >> 27U)) * 0x94D049BB133111EBU;
  seed ^= seed >> 31U;
  return seed == 0 ? 1 : seed;
}

inline namespace LKEMU_ISA {

/// Returns a deviate of mean 0 and variance 1: the sum of the four 16-bit quarters of xorshift64
/// (Marsaglia 2003), without a logarithm. Irwin–Hall, n = 4: bounded by ±3.46, kurtosis 2.7. `Word`
/// is one generator or a register of generators. Advances the generators.
template <class Word>
inline auto normal_deviate(Word& word) {
  word ^= word << 13;
  word ^= word >> 7;
  word ^= word << 17;
  const Word quarters = 0x0000FFFF0000FFFFU;
  const Word pairs = (word & quarters) + ((word >> 16) & quarters);
  const Word sum = (pairs & Word(0x1FFFFU)) + (pairs >> 32);
  // Converts the sum to a double: puts it into the low mantissa bits of 2^52, then subtracts 2^52
  // and the mean (4·65535/2). Standard deviation: sqrt(4·(65536² − 1)/12) = 37837.2.
  const auto centred = as_number(sum | Word(0x4330000000000000U)) - (0x1p52 + 131070.0);
  return centred * (1.0 / 37837.227);
}
inline Pair normal_deviate(WordPair& words) {
  // Braces fix the order of evaluation; each half has its own generators anyway.
  return {normal_deviate(words.low), normal_deviate(words.high)};
}

// Copy generators from and to their stored form, starting at drive `first` of the block.
template <class Word>
inline void load(Word& word, const NoiseState<double>& stored, std::size_t /*first*/) {
  word = stored.word[0];
}
inline void load(Words& words, const NoiseState<Wide>& stored, std::size_t first) {
  words.copy_from(stored.word.data() + first, stdx::vector_aligned);
}
inline void load(WordPair& words, const NoiseState<Wide>& stored, std::size_t first) {
  load(words.low, stored, first);
  load(words.high, stored, first + Words::size());
}
inline void store(std::uint64_t word, NoiseState<double>& stored, std::size_t /*first*/) {
  stored.word[0] = word;
}
inline void store(const WordsOf<Solo>& words, NoiseState<double>& stored, std::size_t /*first*/) {
  stored.word[0] = words[0];
}
inline void store(const Words& words, NoiseState<Wide>& stored, std::size_t first) {
  words.copy_to(stored.word.data() + first, stdx::vector_aligned);
}
inline void store(const WordPair& words, NoiseState<Wide>& stored, std::size_t first) {
  store(words.low, stored, first);
  store(words.high, stored, first + Words::size());
}

}  // namespace LKEMU_ISA
}  // namespace lk::model
