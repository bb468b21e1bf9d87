#pragma once

/// @file A `Real` and the form in which a block stores it; one drive of it.

#include "model/real.hpp"

namespace lk::model {
inline namespace LKEMU_ISA {

/// A word beside every drive of a `Real`.
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

/// How many drives a `Real` holds.
template <class Real>
inline constexpr std::size_t kSizeOf = Real::size();
template <>
inline constexpr std::size_t kSizeOf<double> = 1;
template <>
inline constexpr std::size_t kSizeOf<Solo> = 1;

// A `Real` from its stored form and back, beginning at drive `first` of the block.
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

// One drive's share of a value, for what is decided drive by drive.
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

// One drive's value in stored form.
inline double& lane_of(double& stored, std::size_t /*lane*/) { return stored; }
inline double& lane_of(Wide& stored, std::size_t lane) { return stored.lane[lane]; }
inline double lane_of(const double& stored, std::size_t /*lane*/) { return stored; }
inline double lane_of(const Wide& stored, std::size_t lane) { return stored.lane[lane]; }

}  // namespace lk::model
