#include "tools/campaign/report/latency_counts.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace lk::emulator {

std::int64_t LatencyCounts::rounded_up(std::int64_t latency_ns) const {
  if (latency_ns <= 0) return latency_ns;
  const int width = static_cast<int>(std::bit_width(static_cast<std::uint64_t>(latency_ns)));
  const std::int64_t step = std::int64_t{1} << std::max(0, width - bits_);
  return (latency_ns + (step - 1)) / step * step;
}

void LatencyCounts::add(SimTime latency) {
  const std::int64_t latency_ns = latency.count();
  worst_ns_ = count_ == 0 ? latency_ns : std::max(worst_ns_, latency_ns);
  ++count_;
  ++counts_[rounded_up(latency_ns)];
  while (counts_.size() > kMostDistinct) {
    bits_ = std::min(bits_, 24) - 1;  // 2⁻²² of a latency is less than anybody reads
    std::map<std::int64_t, std::uint64_t> coarser;
    for (const auto& [value, times] : counts_) coarser[rounded_up(value)] += times;
    counts_ = std::move(coarser);
  }
}

std::optional<SimTime> LatencyCounts::worst() const {
  return count_ > 0 ? std::optional(SimTime(worst_ns_)) : std::nullopt;
}

std::optional<SimTime> LatencyCounts::quantile(double share) const {
  if (count_ == 0) return std::nullopt;
  const auto rank = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (const auto& [value, times] : counts_) {
    seen += times;
    if (seen >= rank) return SimTime(std::min(value, worst_ns_));
  }
  return worst();
}

std::vector<LatencyCounts::Bin> LatencyCounts::bins() const {
  constexpr double kPerDecade = 8;
  std::map<int, std::uint64_t> bins;
  for (const auto& [value, times] : counts_) {
    const double latency_s = std::max(1e-6, static_cast<double>(value) * 1e-9);
    bins[static_cast<int>(std::ceil(kPerDecade * std::log10(latency_s) - 1e-9))] += times;
  }
  std::vector<Bin> list;
  list.reserve(bins.size());
  for (const auto& [bin, times] : bins) list.push_back({std::pow(10, bin / kPerDecade), times});
  return list;
}

}  // namespace lk::emulator
