#include "tools/identify/voltage_fit.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace lk::emulator {
namespace {

/// At the limit is what gives so much less than it is told, in the direction in which it turns
/// (assumed).
constexpr double kShare = 0.8;
constexpr double kLess_A = 0.3;
constexpr std::size_t kFewest = 40;
/// The fastest of them are so much faster than the slowest (assumed).
constexpr double kSpread = 1.3;
constexpr double kFewDegrees = 2.1;  // 95 % of Student's t with 19
constexpr std::size_t kJackknifeParts = 20;   // of the jackknife

/// Current and speed in the direction of turning, and the voltage of the supply then (0: unknown).
struct LimitedPoint {
  double speed_rad_s, iq_A, supply_V;
};

std::vector<LimitedPoint> limited(const Track& track) {
  std::vector<LimitedPoint> points;
  for (std::size_t n = 1; n < track.samples.size(); ++n) {
    const TrackSample& sample = track.samples[n];
    const auto next =
        std::ranges::upper_bound(track.orders, sample.time_s, {}, &TrackOrder::time_s);
    if (next == track.orders.begin() || (next - 1)->what != Follows::kTorque) continue;
    const double told_A = (next - 1)->value;
    const double sign = told_A > 0 ? 1 : -1;
    // The same order a sample before: the current has come to where it goes.
    const auto earlier = std::ranges::upper_bound(track.orders, track.samples[n - 1].time_s, {},
                                                  &TrackOrder::time_s);
    if (earlier == track.orders.begin() || (earlier - 1)->value != told_A) continue;
    const double iq_A = sign * sample.iq_A;
    if (sign * sample.speed_rad_s <= 0 || iq_A > kShare * sign * told_A ||
        iq_A > sign * told_A - kLess_A) {
      continue;
    }
    points.push_back({sign * sample.speed_rad_s, iq_A, track.supply_V});
  }
  return points;
}

/// iq = a − b·ω
struct Line {
  double a, b;
};
Line line_of(const std::vector<LimitedPoint>& points, std::size_t without) {
  double n = 0, w = 0, i = 0, ww = 0, wi = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (k * kJackknifeParts / points.size() == without) continue;
    const LimitedPoint& p = points[k];
    n += 1;
    w += p.speed_rad_s;
    i += p.iq_A;
    ww += p.speed_rad_s * p.speed_rad_s;
    wi += p.speed_rad_s * p.iq_A;
  }
  const double b = -(n * wi - w * i) / (n * ww - w * w);
  return {(i + b * w) / n, b};
}

template <class Function>
Estimate estimate(const std::vector<LimitedPoint>& points, Function of) {
  double mean = 0;
  std::vector<double> without;
  for (std::size_t part = 0; part < kJackknifeParts; ++part) {
    without.push_back(of(line_of(points, part)));
    mean += without.back() / kJackknifeParts;
  }
  double squares = 0;
  for (const double one : without) squares += (one - mean) * (one - mean);
  return {of(line_of(points, kJackknifeParts)), kFewDegrees * std::sqrt(squares * (kJackknifeParts - 1) / kJackknifeParts)};
}

}  // namespace

std::optional<VoltageFit> fit_voltage(const Track& track) {
  std::vector<LimitedPoint> points = limited(track);
  if (points.size() < kFewest) return std::nullopt;
  const auto [slowest, fastest] = std::ranges::minmax_element(points, {}, &LimitedPoint::speed_rad_s);
  if (fastest->speed_rad_s < kSpread * slowest->speed_rad_s) return std::nullopt;
  // The parts of the jackknife have all speeds.
  VoltageFit fit{estimate(points, [](const Line& l) { return l.a; }),
                 estimate(points, [](const Line& l) { return l.a / l.b; }), {}, {}};
  if (!(fit.stall_A.value > 0) || !(fit.no_load_rad_s.value > 0)) return std::nullopt;
  if (track.supply_V <= 0) return fit;
  // docs/model.md §9: the largest voltage of a phase.
  const double most_V =
      (2 * track.servo.profile.drive.inverter.duty_max - 1) * track.supply_V / std::sqrt(3.0);
  fit.k_t_Nm_A = estimate(points, [most_V](const Line& l) { return 1.5 * most_V * l.b / l.a; });
  fit.R_ohm = estimate(points, [most_V](const Line& l) { return most_V / l.a; });
  return fit;
}

}  // namespace lk::emulator
