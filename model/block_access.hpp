#pragma once

/// @file Reads and writes the data of one drive in a block.

#include <algorithm>

#include "model/stored_real.hpp"
#include "model/tick.hpp"

namespace lk::model {

/// `put` copies a struct of one drive into a lane of its stored form; `get` copies it out.
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

/// Returns true if a drive of the block needs the tick with faults.
template <class Store>
bool any_faulty(const TickBlock<Store>& block) {
  return std::any_of(block.faults.begin(), block.faults.end(),
                     [](const LaneFaults& faults) { return faults.any(); });
}

}  // namespace lk::model
