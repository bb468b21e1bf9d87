#pragma once

/// @file One drive's share of a block.

#include <algorithm>

#include "model/stored_real.hpp"
#include "model/tick.hpp"

namespace lk::model {

/// A scalar struct of the tick goes into, or comes out of, one lane of its stored form.
template <class Stored, class Scalar>
void put(Stored& stored, std::size_t lane, const Scalar& value) {
  for_each_field(fields(stored), fields(value),
                 [lane](auto& to, const double& from) { lane_of(to, lane) = from; });
}
template <class Scalar, class Stored>
Scalar get(const Stored& stored, std::size_t lane) {
  Scalar value;
  for_each_field(fields(value), fields(stored),
                 [lane](double& to, const auto& from) { to = lane_of(from, lane); });
  return value;
}

/// Whether some drive of the block needs the tick that looks at faults.
template <class Store>
bool any_faulty(const TickBlock<Store>& block) {
  return std::any_of(block.faults.begin(), block.faults.end(),
                     [](const LaneFaults& faults) { return faults.any(); });
}

}  // namespace lk::model
