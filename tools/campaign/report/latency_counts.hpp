#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// Latencies of any number of cases in bounded memory. They are kept exactly up to kMostDistinct
/// different ones; beyond, all are rounded up to fewer significant bits, so that no latency is told
/// shorter than it was. The worst is always exact.
class LatencyCounts {
 public:
  static constexpr std::size_t kMostDistinct = 10'000;

  void add(SimTime latency);

  std::uint64_t count() const { return count_; }
  /// Some are not exact.
  bool rounded() const { return bits_ < kAllBits; }
  std::optional<SimTime> worst() const;
  /// The nearest rank: the least latency that at least this share of all do not exceed; `share` is
  /// above 0, up to 1.
  std::optional<SimTime> quantile(double share) const;

  struct Bin {
    double up_to_s = 0;
    std::uint64_t count = 0;
  };
  /// How they spread: eight bins to a decade, from 1 µs on; empty ones are left out.
  std::vector<Bin> bins() const;

 private:
  static constexpr int kAllBits = 63;
  std::int64_t rounded_up(std::int64_t latency_ns) const;

  std::map<std::int64_t, std::uint64_t> counts_;  // by latency, ns
  std::uint64_t count_ = 0;
  std::int64_t worst_ns_ = 0;
  int bits_ = kAllBits;  // significant ones
};

}  // namespace lk::emulator
