#include "tools/identify/speed_loop_fit.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <iterator>
#include <numbers>
#include <vector>

namespace lk::emulator {
namespace {

using Complex = std::complex<double>;
using Index = Eigen::Index;

/// After a new speed, for its step to have died away; and what is worth looking at (assumed).
constexpr double kSettles_s = 0.2;
constexpr double kShortest_s = 0.5;
/// Of half the rate of samples: cogging beyond it is not told from slower one.
constexpr double kNyquistShare = 0.8;
/// 95 % of Student's t, by degrees of freedom from 1 on; beyond the last it falls to 1.96.
constexpr double kStudentOf[] = {12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23};
double student(std::size_t degrees) {
  return degrees <= std::size(kStudentOf) ? kStudentOf[degrees - 1]
                                          : 1.96 + 2.7 / static_cast<double>(degrees);
}

/// What the speed loop did about cogging of one order at one speed.
struct Response {
  double omega_rad_s;  // signed: of e^(jnθ)
  Complex gain;        // −iq/ω
  double deviation;    // of each part
};

/// Complex amplitudes at the orders, of the angle about a parabola and of the current about a line.
class Ripple {
 public:
  Ripple(const Track& track, std::size_t first, std::size_t last, const std::vector<int>& orders)
      : count_(static_cast<Index>(last - first)),
        terms_(3 + 2 * static_cast<Index>(orders.size())) {
    Eigen::MatrixXd rows(count_, terms_);
    Eigen::MatrixXd seen(count_, 2);  // angle, current
    const double begin_s = track.samples[first].time_s;
    length_s_ = track.samples[last - 1].time_s - begin_s;
    for (Index k = 0; k < count_; ++k) {
      const TrackSample& sample = track.samples[first + static_cast<std::size_t>(k)];
      const double u = (sample.time_s - begin_s) / length_s_;
      rows.row(k).head(3) << 1, u, u * u;
      for (std::size_t o = 0; o < orders.size(); ++o) {
        const double angle = orders[o] * sample.angle_rad;
        rows(k, 3 + 2 * static_cast<Index>(o)) = std::cos(angle);
        rows(k, 4 + 2 * static_cast<Index>(o)) = std::sin(angle);
      }
      seen.row(k) << sample.angle_rad, sample.iq_A;
    }
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(rows);
    found_ = qr.solve(seen);
    left_ = (rows * found_ - seen).colwise().squaredNorm() / static_cast<double>(count_ - terms_);
  }

  double speed_rad_s() const { return (found_(1, 0) + found_(2, 0)) / length_s_; }
  /// a·cos + b·sin = Re((a − jb)·e^(jnθ))
  Complex angle(std::size_t order) const { return amplitude(order, 0); }
  Complex current(std::size_t order) const { return amplitude(order, 1); }
  double angle_deviation() const { return std::sqrt(2 * left_(0) / static_cast<double>(count_)); }
  double current_deviation() const { return std::sqrt(2 * left_(1) / static_cast<double>(count_)); }

 private:
  Complex amplitude(std::size_t order, Index which) const {
    const Index at = 3 + 2 * static_cast<Index>(order);
    return {found_(at, which), -found_(at + 1, which)};
  }

  Index count_, terms_;
  double length_s_ = 0;
  Eigen::MatrixXd found_;
  Eigen::RowVector2d left_;
};

/// What is between the speed of the shaft and the current: the estimator's lag, a period of the
/// motion loops, the current loop (docs/model.md §10, §11).
Complex loop_delay(const model::DriveParams& drive, double omega_rad_s) {
  const double T_s = 1 / drive.inverter.f_pwm;
  const double T_m = T_s * drive.control.motion_divider;
  const double lag_s = 1 / drive.control.estimator_bandwidth + T_m / 2 + T_m / 2 + T_s +
                       1 / drive.control.current_bandwidth;
  return std::polar(1.0, -omega_rad_s * lag_s);
}

std::vector<Response> responses(const Track& track, const BalanceFit& balance) {
  std::vector<int> orders;
  for (const Cogging& one : balance.cogging) {
    if (is_told(one.amplitude_A)) orders.push_back(one.order);
  }
  std::vector<Response> found;
  if (orders.empty()) return found;
  for (HeldOrder part : held_orders(track, Follows::kSpeed)) {
    const double begin_s = track.samples[part.first].time_s + kSettles_s;
    while (part.first < part.last && track.samples[part.first].time_s < begin_s) ++part.first;
    if (part.first >= part.last ||
        track.samples[part.last - 1].time_s - track.samples[part.first].time_s < kShortest_s ||
        std::abs(part.order->value) < kSlowest_rad_s) {
      continue;
    }
    if (part.last - part.first < 4 * (3 + 2 * orders.size())) continue;
    const Ripple ripple(track, part.first, part.last, orders);
    const double highest = kNyquistShare * std::numbers::pi / track.median_step_s;
    for (std::size_t o = 0; o < orders.size(); ++o) {
      const double omega = orders[o] * ripple.speed_rad_s();
      const Complex s(0, omega);
      const Complex speed = s * ripple.angle(o);
      const double speed_deviation = std::abs(omega) * ripple.angle_deviation();
      if (std::abs(omega) > highest || std::abs(speed) < 4 * speed_deviation) continue;
      const Complex gain =
          -ripple.current(o) / speed / loop_delay(track.servo.profile.drive, omega);
      const double deviation =
          std::hypot(ripple.current_deviation(), std::abs(gain) * speed_deviation) /
          std::abs(speed);
      found.push_back({omega, gain, deviation});
    }
  }
  return found;
}

/// The weighted mean of values with deviations; where they differ by more, so does the mean.
std::optional<Estimate> mean(const std::vector<std::pair<double, double>>& values) {
  if (values.size() < 3) return std::nullopt;
  double sum = 0;
  double weights = 0;
  for (const auto& [value, deviation] : values) {
    sum += value / (deviation * deviation);
    weights += 1 / (deviation * deviation);
  }
  const double middle = sum / weights;
  double chi_squared = 0;
  for (const auto& [value, deviation] : values) {
    chi_squared += std::pow((value - middle) / deviation, 2);
  }
  const double spread = std::max(1.0, chi_squared / static_cast<double>(values.size() - 1));
  return Estimate{middle, student(values.size() - 1) * std::sqrt(spread / weights)};
}

}  // namespace

SpeedLoopFit fit_speed_loop(const Track& track, const BalanceFit& balance) {
  SpeedLoopFit fit;
  std::vector<std::pair<double, double>> kp;
  std::vector<std::pair<double, double>> ki;
  for (const Response& one : responses(track, balance)) {
    // Kp + Ki/(jω)
    kp.emplace_back(one.gain.real(), one.deviation);
    ki.emplace_back(-one.gain.imag() * one.omega_rad_s, one.deviation * std::abs(one.omega_rad_s));
  }
  fit.kp_A_s = mean(kp);
  fit.ki_A = mean(ki);
  return fit;
}

}  // namespace lk::emulator
