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
/// Their currents differ by so much: a line needs two ends (assumed).
constexpr double kSpread_A = 1.5;
constexpr double kFewDegrees = 2.1;          // 95 % of Student's t with 19
constexpr std::size_t kJackknifeParts = 20;  // of the jackknife

/// Current and speed in the direction of turning.
struct LimitedPoint {
  double speed_rad_s, iq_A;
};

std::vector<LimitedPoint> limited(const Track& track) {
  std::vector<LimitedPoint> points;
  for (std::size_t n = 1; n < track.samples.size(); ++n) {
    const TrackSample& sample = track.samples[n];
    const auto next =
        std::ranges::upper_bound(track.orders, sample.time_s, {}, &TrackOrder::time_s);
    if (next == track.orders.begin() || (next - 1)->what != Follows::kTorque) continue;
    const double told_A = (next - 1)->value;
    if (told_A == 0) continue;
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
    points.push_back({sign * sample.speed_rad_s, iq_A});
  }
  return points;
}

struct Windings {
  double R, p_psi;
};
/// A torque limit gives less than it is told, too, at any speed: where many points have the largest
/// current, within noise, it is that one, and they are none of the voltage (assumed).
void leave_out_plateau(std::vector<LimitedPoint>& points) {
  constexpr double kNoise_A = 0.3;
  const double most_A = std::ranges::max(points, {}, &LimitedPoint::iq_A).iq_A;
  const auto is_high = [most_A](const LimitedPoint& p) { return p.iq_A > most_A - kNoise_A; };
  if (5 * std::ranges::count_if(points, is_high) > std::ssize(points))
    std::erase_if(points, is_high);
}

/// By least squares, without one part of the points.
Windings windings_of(const std::vector<LimitedPoint>& points, std::size_t without, double most_V,
                     const model::MotorParams& motor) {
  double ii = 0, iw = 0, ww = 0, iv = 0, wv = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (k * kJackknifeParts / points.size() == without) continue;
    const auto& [w, i] = points[k];
    const double d_V = motor.pole_pairs * w * motor.L_q * i;
    const double v = std::sqrt(std::max(most_V * most_V - d_V * d_V, 0.0));
    ii += i * i;
    iw += i * w;
    ww += w * w;
    iv += i * v;
    wv += w * v;
  }
  const double determinant = ii * ww - iw * iw;
  return {(iv * ww - wv * iw) / determinant, (wv * ii - iv * iw) / determinant};
}

}  // namespace

std::optional<VoltageFit> fit_voltage(const Track& track) {
  std::vector<LimitedPoint> points = limited(track);
  if (!points.empty()) leave_out_plateau(points);
  if (points.size() < kFewest) return std::nullopt;
  const auto [least, most] = std::ranges::minmax_element(points, {}, &LimitedPoint::iq_A);
  if (most->iq_A < least->iq_A + kSpread_A) return std::nullopt;
  const model::DriveParams& drive = track.servo.profile.drive;
  const double supply_V = track.supply_V > 0 ? track.supply_V : drive.supply.v_source;
  // docs/model.md §9: the largest voltage of a phase.
  const double most_V = (2 * drive.inverter.duty_max - 1) * supply_V / std::sqrt(3.0);
  const auto estimate = [&](auto of) {
    double mean = 0;
    std::vector<double> without;
    for (std::size_t part = 0; part < kJackknifeParts; ++part) {
      without.push_back(of(windings_of(points, part, most_V, drive.motor)));
      mean += without.back() / kJackknifeParts;
    }
    double squares = 0;
    for (const double one : without) squares += (one - mean) * (one - mean);
    // The voltage itself is known to 1 % (assumed).
    const double value = of(windings_of(points, kJackknifeParts, most_V, drive.motor));
    return Estimate{
        value, std::hypot(0.01 * value, kFewDegrees * std::sqrt(squares * (kJackknifeParts - 1) /
                                                                kJackknifeParts))};
  };
  VoltageFit fit{estimate([most_V](const Windings& w) { return most_V / w.p_psi; }), {}, {}};
  if (track.supply_V <= 0) return fit;
  fit.k_t_Nm_A = estimate([](const Windings& w) { return 1.5 * w.p_psi; });
  fit.R_ohm = estimate([](const Windings& w) { return w.R; });
  return fit;
}

}  // namespace lk::emulator
