#include "tools/decode/latency_histogram.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace lk::emulator {
namespace {

constexpr unsigned kBits = 5;                       // an octave has 32 steps
constexpr std::uint64_t kExact_us = 2ULL << kBits;  // below, a step is 1 µs
constexpr std::uint64_t kMost_us = 1ULL << 40U;     // twelve days; larger values are clamped

std::size_t place_of(std::uint64_t us) {
  if (us < kExact_us) return us;
  const unsigned shift = static_cast<unsigned>(std::bit_width(us)) - kBits - 1;
  return (std::size_t{shift} << kBits) + (us >> shift);
}

/// Returns the middle of a bin.
SimTime middle_of(std::size_t place) {
  if (place < kExact_us) return std::chrono::microseconds(place);
  const std::size_t shift = (place >> kBits) - 1;
  const std::uint64_t first = (place - (shift << kBits)) << shift;
  return SimTime((first * 2 + (std::uint64_t{1} << shift)) * 500);
}

}  // namespace

void LatencyHistogram::add(SimTime latency) {
  if (latency < SimTime{0}) return;
  const auto us = static_cast<std::uint64_t>(latency.count()) / 1000;
  const std::size_t place = place_of(std::min(us, kMost_us));
  if (place >= counts_.size()) counts_.resize(place + 1);
  ++counts_[place];
  min_ = count_ == 0 ? latency : std::min(min_, latency);
  max_ = std::max(max_, latency);
  ++count_;
}

SimTime LatencyHistogram::quantile(double share) const {
  if (count_ == 0) return SimTime{0};
  const double wanted = std::ceil(share * static_cast<double>(count_));
  const auto rank = std::clamp<std::uint64_t>(static_cast<std::uint64_t>(wanted), 1, count_);
  std::uint64_t seen = 0;
  std::size_t place = 0;
  while ((seen += counts_[place]) < rank) ++place;
  return std::clamp(middle_of(place), min_, max_);
}

}  // namespace lk::emulator
