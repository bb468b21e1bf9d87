#pragma once

/// @file Converts between a `Real`, its stored form in a block, and the value of one drive.

#include "model/real.hpp"

namespace lk::model {
inline namespace LKEMU_ISA {

/// One 64-bit word for each drive of a `Pair`.
struct WordPair {
  Words low, high;
};
template <class Real>
struct WordsBeside {
  using type = stdx::rebind_simd_t<std::uint64_t, Real>;
};
template <>
struct WordsBeside<Pair> {
  using type = WordPair;
};
template <>
struct WordsBeside<double> {
  using type = std::uint64_t;
};
template <class Real>
using WordsOf = typename WordsBeside<Real>::type;

/// Number of drives in a `Real`.
template <class Real>
inline constexpr std::size_t kSizeOf = Real::size();
template <>
inline constexpr std::size_t kSizeOf<double> = 1;
template <>
inline constexpr std::size_t kSizeOf<Solo> = 1;

// Copy a `Real` from and to its stored form, starting at drive `first` of the block.
inline void load(double& value, const double& stored, std::size_t /*first*/) { value = stored; }
inline void load(Solo& value, const double& stored, std::size_t /*first*/) { value = stored; }
inline void load(Lanes& value, const Wide& stored, std::size_t first) {
  value.copy_from(stored.lane.data() + first, stdx::vector_aligned);
}
inline void store(double value, double& stored, std::size_t /*first*/) { stored = value; }
inline void store(const Solo& value, double& stored, std::size_t /*first*/) { stored = value[0]; }
inline void store(const Lanes& value, Wide& stored, std::size_t first) {
  value.copy_to(stored.lane.data() + first, stdx::vector_aligned);
}

// Read and write the value of one drive in a `Real`, for code that branches per drive.
inline double get_lane(double x, std::size_t /*lane*/) { return x; }
inline double get_lane(const Solo& x, std::size_t /*lane*/) { return x[0]; }
inline double get_lane(const Lanes& x, std::size_t lane) { return x[lane]; }
inline void set_lane(double& x, std::size_t /*lane*/, double value) { x = value; }
inline void set_lane(Solo& x, std::size_t /*lane*/, double value) { x = value; }
inline void set_lane(Lanes& x, std::size_t lane, double value) {
  Wide all;
  store(x, all, 0);
  all.lane[lane] = value;
  load(x, all, 0);
}
inline bool lane_set(bool mask, std::size_t /*lane*/) { return mask; }
inline bool lane_set(const Solo::mask_type& mask, std::size_t /*lane*/) { return mask[0]; }
inline bool lane_set(const Lanes::mask_type& mask, std::size_t lane) { return mask[lane]; }

}  // namespace LKEMU_ISA

// Returns the stored value of one drive.
inline double& lane_of(double& stored, std::size_t /*lane*/) { return stored; }
inline double& lane_of(Wide& stored, std::size_t lane) { return stored.lane[lane]; }
inline double lane_of(const double& stored, std::size_t /*lane*/) { return stored; }
inline double lane_of(const Wide& stored, std::size_t lane) { return stored.lane[lane]; }

}  // namespace lk::model
