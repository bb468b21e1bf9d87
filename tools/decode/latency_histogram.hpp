#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Histogram of latencies in bounded memory. Exact up to 63 µs, to 1/32 beyond, so that a quantile
/// is off by at most 1.6 %. Minimum and maximum are exact.
class LatencyHistogram {
 public:
  /// Ignores negative times.
  void add(SimTime latency);
  std::uint64_t count() const { return count_; }
  SimTime min() const { return min_; }
  SimTime max() const { return max_; }
  /// Returns the quantile `share`, 0..1, by nearest rank; 0 without latencies.
  SimTime quantile(double share) const;

 private:
  std::vector<std::uint64_t> counts_;  // about 400 bins for 100 ms
  std::uint64_t count_ = 0;
  SimTime min_{0};
  SimTime max_{0};
};

}  // namespace lk::emulator
