#pragma once

/// @file One drive's share of a block.

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

}  // namespace lk::model
