#include "tools/guess/encoder_watch.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace lk::emulator {
namespace {

using namespace std::chrono_literals;

// All assumed: far above noise, and small enough for a field that wraps around.
constexpr double kLeastTurn_cdeg = 1000;
constexpr double kMostTurn_cdeg = 12'000;
constexpr SimTime kTogether = 20ms;  // longest time from the field to the angle
constexpr int kAtRest_dps = 3;
constexpr std::size_t kFewestTurns = 3;
constexpr std::size_t kMostTurns = 63;
constexpr double kTolerance = 0.03;

// Counts per turn of LK-TECH encoders: 12, 14, 15 and 16 bits; 18-bit ones show 16.
constexpr double kRotorTurns[] = {4096, 16'384, 32'768, 65'536};
// Ratios of the geared motors (docs/which-drive.md); their encoders have 18 bits.
constexpr double kRatios[] = {6, 8, 9, 10, 36};

bool is_near(double value, double expected) { return std::abs(value / expected - 1) <= kTolerance; }

}  // namespace

void EncoderWatch::field(std::uint16_t counts, std::optional<int> speed_dps,
                         std::optional<SimTime> at) {
  largest_ = std::max(largest_.value_or(0), counts);
  last_ = {counts, speed_dps, at};
}

std::optional<EncoderSpan> EncoderWatch::angle(std::int64_t angle_cdeg, std::optional<SimTime> at) {
  if (!last_ || !last_->speed_dps) return std::nullopt;
  double since_s = 0;
  if (at && last_->at) {
    if (*at < *last_->at || *at - *last_->at > kTogether) return std::nullopt;
    since_s = std::chrono::duration<double>(*at - *last_->at).count();
  } else if (std::abs(*last_->speed_dps) > kAtRest_dps) {
    return std::nullopt;
  }
  const Place now{static_cast<double>(angle_cdeg) - 100.0 * *last_->speed_dps * since_s,
                  last_->counts};
  if (!from_) from_ = now;
  const double turned_cdeg = now.angle_cdeg - from_->angle_cdeg;
  if (std::abs(turned_cdeg) < kLeastTurn_cdeg) return std::nullopt;
  const double per_turn = (now.counts - from_->counts) / turned_cdeg * 36'000;
  from_ = now;
  if (std::abs(turned_cdeg) > kMostTurn_cdeg) return std::nullopt;
  if (per_turn_.size() < kMostTurns) per_turn_.push_back(per_turn);
  for (const double counts : kRotorTurns) {
    if (is_near(per_turn, counts)) return EncoderSpan::kRotorTurn;
  }
  for (const double ratio : kRatios) {
    if (is_near(per_turn * ratio, kRotorTurns[3])) return EncoderSpan::kOutputTurn;
  }
  return std::nullopt;
}

/// Uses the median, because a field that wraps around in between is off by a turn.
std::optional<double> EncoderWatch::counts_per_turn() const {
  if (per_turn_.size() < kFewestTurns) return std::nullopt;
  std::vector<double> sorted = per_turn_;
  std::ranges::sort(sorted);
  const double median = sorted[sorted.size() / 2];
  const auto agree = std::ranges::count_if(
      sorted, [median](double one) { return median != 0 && is_near(one, median); });
  return 2 * static_cast<std::size_t>(agree) > sorted.size() ? std::optional(median) : std::nullopt;
}

}  // namespace lk::emulator
