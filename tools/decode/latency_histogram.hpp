#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Any number of latencies in little room: exact up to 63 µs, to 1/32 beyond, so that a quantile
/// is off by 1.6 % at most. The least and the largest are exact.
class LatencyHistogram {
 public:
  /// Nothing for times before 0.
  void add(SimTime latency);
  std::uint64_t count() const { return count_; }
  SimTime min() const { return min_; }
  SimTime max() const { return max_; }
  /// The smallest latency that `share` of them, 0..1, do not exceed (nearest rank); 0 when there
  /// are none.
  SimTime quantile(double share) const;

 private:
  std::vector<std::uint64_t> counts_;  // grows to some 400, for 100 ms
  std::uint64_t count_ = 0;
  SimTime min_{0};
  SimTime max_{0};
};

}  // namespace lk::emulator
