#include "tools/identify/torque_balance.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <optional>

namespace lk::emulator {
namespace {

constexpr int kParts = 8;  // of the time between two samples
/// A drive that gives less than it was told is out of voltage or at a limit: by more than this it
/// is not noise (assumed).
constexpr double kNotGiven_A = 0.5;

/// One instant within a window, and its share of it.
struct Point {
  double angle_rad, speed_rad_s, weight_s;
};

class Paths {
 public:
  explicit Paths(const Track& track) : track_(track), nodes_(track.samples.size()) {
    for (const Stretch& stretch : stretches(track)) {
      for (std::size_t n = stretch.first; n < stretch.last; ++n) nodes_[n] = node_speed(stretch, n);
    }
    half_ = std::max<std::size_t>(
        1, static_cast<std::size_t>(std::lround(kHalfWindow_s / track.median_step_s)));
  }

  /// Calls `take(first, middle, last)` for each window that turns one way.
  template <class Take>
  void each(Take take) const {
    for (const Stretch& stretch : stretches(track_)) {
      for (std::size_t k = stretch.first + half_; k + half_ < stretch.last; k += half_) {
        if (turns(k - half_, k + half_)) take(k - half_, k, k + half_);
      }
    }
  }
  /// Calls `take(Point)` along the path from one sample to the next, with the window's weights. For
  /// measured currents at the samples, as these are interpolated: what is too fast for that is
  /// missed on both sides.
  template <class Take>
  void along(std::size_t n, std::size_t first, std::size_t middle, std::size_t last, bool commanded,
             Take take) const {
    const TrackSample& a = track_.samples[n];
    const TrackSample& b = track_.samples[n + 1];
    const double step_s = b.time_s - a.time_s;
    if (!commanded) {
      const double from = weight(a.time_s, first, middle, last);
      const double to = weight(b.time_s, first, middle, last);
      take(Point{a.angle_rad, nodes_[n], (2 * from + to) * step_s / 6});
      take(Point{b.angle_rad, nodes_[n + 1], (from + 2 * to) * step_s / 6});
      return;
    }
    for (int part = 0; part < kParts; ++part) {
      const double u = (part + 0.5) / kParts;
      // Hermite's cubic through both angles with both speeds.
      const double v = 1 - u;
      const double angle_rad = v * v * (1 + 2 * u) * a.angle_rad +
                               u * u * (1 + 2 * v) * b.angle_rad +
                               u * v * step_s * (v * nodes_[n] - u * nodes_[n + 1]);
      const double speed_rad_s = 6 * u * v * (b.angle_rad - a.angle_rad) / step_s +
                                 v * (v - 2 * u) * nodes_[n] + u * (u - 2 * v) * nodes_[n + 1];
      const double at_s = a.time_s + u * step_s;
      take(Point{angle_rad, speed_rad_s, weight(at_s, first, middle, last) * step_s / kParts});
    }
  }
  double weight(double at_s, std::size_t first, std::size_t middle, std::size_t last) const {
    const auto time_s = [this](std::size_t n) { return track_.samples[n].time_s; };
    return at_s < time_s(middle) ? (at_s - time_s(first)) / (time_s(middle) - time_s(first))
                                 : (time_s(last) - at_s) / (time_s(last) - time_s(middle));
  }

 private:
  /// Of the parabola through a sample and its neighbours.
  double node_speed(const Stretch& stretch, std::size_t n) const {
    if (stretch.last - stretch.first < 2) return 0;
    const auto slope = [this](std::size_t from) {
      const TrackSample& a = track_.samples[from];
      const TrackSample& b = track_.samples[from + 1];
      return (b.angle_rad - a.angle_rad) / (b.time_s - a.time_s);
    };
    if (n == stretch.first) return slope(n);
    if (n + 1 == stretch.last) return slope(n - 1);
    const double before_s = track_.samples[n].time_s - track_.samples[n - 1].time_s;
    const double after_s = track_.samples[n + 1].time_s - track_.samples[n].time_s;
    return (slope(n - 1) * after_s + slope(n) * before_s) / (before_s + after_s);
  }
  bool turns(std::size_t first, std::size_t last) const {
    const double sign = nodes_[first] > 0 ? 1 : -1;
    for (std::size_t n = first; n <= last; ++n) {
      if (sign * nodes_[n] < kSlowest_rad_s) return false;
      // Between samples it must not have stood still either.
      if (n > first &&
          sign * (track_.samples[n].angle_rad - track_.samples[n - 1].angle_rad) <= 0) {
        return false;
      }
    }
    return true;
  }

  const Track& track_;
  std::vector<double> nodes_;  // speeds
  std::size_t half_ = 1;
};

/// What the drive gave over time.
class Current {
 public:
  Current(const Track& track, double delay_s) : track_(track), delay_s_(delay_s) {}

  struct Given {
    double iq_A_s = 0;  // times the weights
    bool commanded = true;
    bool sure = true;
  };
  Given given(const Paths& paths, std::size_t first, std::size_t middle, std::size_t last) {
    Given sum;
    for (std::size_t n = first; n < last; ++n) {
      const auto at = follow(track_.samples[n].time_s);
      sum.commanded = sum.commanded && at != nullptr && at->what == Follows::kTorque &&
                      only_torque_until(track_.samples[n + 1].time_s);
    }
    for (std::size_t n = first; n < last; ++n) {
      const TrackSample& a = track_.samples[n];
      const TrackSample& b = track_.samples[n + 1];
      if (sum.commanded) {
        add_commanded(paths, n, first, middle, last, sum);
      } else {
        const double from = paths.weight(a.time_s, first, middle, last);
        const double to = paths.weight(b.time_s, first, middle, last);
        sum.iq_A_s +=
            (b.time_s - a.time_s) * ((2 * from + to) * a.iq_A + (from + 2 * to) * b.iq_A) / 6;
      }
    }
    return sum;
  }

 private:
  /// The order in force at a time; null: none yet.
  const TrackOrder* follow(double time_s) {
    auto next = std::ranges::upper_bound(track_.orders, time_s - delay_s_, {}, &TrackOrder::time_s);
    place_ = static_cast<std::size_t>(next - track_.orders.begin());
    return place_ == 0 ? nullptr : &track_.orders[place_ - 1];
  }
  /// After `follow`.
  bool only_torque_until(double time_s) const {
    for (std::size_t n = place_; n < track_.orders.size(); ++n) {
      if (track_.orders[n].time_s + delay_s_ > time_s) break;
      if (track_.orders[n].what != Follows::kTorque) return false;
    }
    return true;
  }
  void add_commanded(const Paths& paths, std::size_t n, std::size_t first, std::size_t middle,
                     std::size_t last, Given& sum) {
    const double begin_s = track_.samples[n].time_s;
    const double end_s = track_.samples[n + 1].time_s;
    const TrackOrder* order = follow(begin_s);
    double from_s = begin_s;
    std::size_t next = place_;
    while (from_s < end_s) {
      double to_s = end_s;
      const TrackOrder* then = nullptr;
      if (next < track_.orders.size() && track_.orders[next].time_s + delay_s_ < end_s) {
        then = &track_.orders[next++];
        to_s = std::max(from_s, then->time_s + delay_s_);
      }
      const double middle_weight = paths.weight((from_s + to_s) / 2, first, middle, last);
      sum.iq_A_s += order->value * middle_weight * (to_s - from_s);
      from_s = to_s;
      if (then == nullptr) break;
      order = then;
    }
    // Measured where nothing changed around it: given as it was told?
    const bool ended = place_ != next;
    const double told_A = order->value;
    const TrackOrder* const earlier = follow(begin_s - track_.median_step_s);
    const bool steady = !ended && earlier != nullptr && earlier->value == told_A;
    const double off_A = std::abs(track_.samples[n].iq_A - told_A);
    if (steady && off_A > kNotGiven_A + 0.2 * std::abs(told_A)) sum.sure = false;
  }

  const Track& track_;
  double delay_s_;
  std::size_t place_ = 0;
};

double friction_shape(const model::MechanicsParams& m, double speed_rad_s) {
  const double excess = m.tau_coulomb > 0 ? m.tau_static / m.tau_coulomb - 1 : 0;
  const double ratio = speed_rad_s / m.omega_stribeck;
  return std::copysign(1 + excess / (1 + ratio * ratio), speed_rad_s);
}

}  // namespace

std::vector<BalanceWindow> balance_windows(const Track& track, const BalanceShape& shape) {
  const std::vector<int>& orders = shape.orders;
  const model::MechanicsParams& m = track.servo.profile.drive.mechanics;
  const Paths paths(track);
  Current current(track, shape.delay_s);
  std::vector<BalanceWindow> found;
  paths.each([&](std::size_t first, std::size_t middle, std::size_t last) {
    const auto given = current.given(paths, first, middle, last);
    if (!given.sure) return;
    const TrackSample& a = track.samples[first];
    const TrackSample& b = track.samples[middle];
    const TrackSample& c = track.samples[last];
    const double whole_s = (c.time_s - a.time_s) / 2;
    Eigen::VectorXd terms =
        Eigen::VectorXd::Zero(kFixedTerms + 2 * static_cast<Eigen::Index>(orders.size()));
    const auto term = [&terms](BalanceTerm which) -> double& {
      return terms(static_cast<Eigen::Index>(which));
    };
    for (std::size_t n = first; n < last; ++n) {
      paths.along(n, first, middle, last, given.commanded, [&](const Point& point) {
        const double loss =
            std::abs(std::sin(point.angle_rad / m.gear_ratio + shape.gravity_phase_rad));
        const double out_rad = point.angle_rad / m.gear_ratio;
        term(BalanceTerm::kCoulomb) += friction_shape(m, point.speed_rad_s) * point.weight_s;
        term(BalanceTerm::kGearLoss) += std::copysign(loss, point.speed_rad_s) * point.weight_s;
        term(BalanceTerm::kViscous) += point.speed_rad_s * point.weight_s;
        term(BalanceTerm::kGravitySin) += std::sin(out_rad) * point.weight_s;
        term(BalanceTerm::kGravityCos) += std::cos(out_rad) * point.weight_s;
        for (std::size_t k = 0; k < orders.size(); ++k) {
          const auto place = kFixedTerms + 2 * static_cast<Eigen::Index>(k);
          terms(place) += std::cos(orders[k] * point.angle_rad) * point.weight_s;
          terms(place + 1) += std::sin(orders[k] * point.angle_rad) * point.weight_s;
        }
      });
    }
    terms /= whole_s;
    term(BalanceTerm::kInertia) = ((c.angle_rad - b.angle_rad) / (c.time_s - b.time_s) -
                                   (b.angle_rad - a.angle_rad) / (b.time_s - a.time_s)) /
                                  whole_s;
    term(BalanceTerm::kConstant) = 1;
    if (given.commanded) {
      term(BalanceTerm::kPulseCoulomb) = term(BalanceTerm::kCoulomb);
      term(BalanceTerm::kPulseViscous) = term(BalanceTerm::kViscous);
    }
    found.push_back({b.time_s, b.angle_rad, term(BalanceTerm::kViscous), given.iq_A_s / whole_s,
                     given.commanded, std::move(terms), first, middle, last});
  });
  return found;
}

Eigen::MatrixXcd order_averages(const Track& track, const std::vector<BalanceWindow>& windows,
                                std::size_t every, int highest) {
  const Paths paths(track);
  const auto count = static_cast<Eigen::Index>((windows.size() + every - 1) / every);
  Eigen::MatrixXcd averages = Eigen::MatrixXcd::Zero(count, highest);
  for (Eigen::Index row = 0; row < count; ++row) {
    const BalanceWindow& window = windows[static_cast<std::size_t>(row) * every];
    const double whole_s =
        (track.samples[window.last].time_s - track.samples[window.first].time_s) / 2;
    for (std::size_t n = window.first; n < window.last; ++n) {
      paths.along(n, window.first, window.middle, window.last, window.commanded,
                  [&](const Point& point) {
                    const std::complex<double> once = std::polar(1.0, point.angle_rad);
                    std::complex<double> power = point.weight_s / whole_s;
                    for (int order = 0; order < highest; ++order)
                      averages(row, order) += power *= once;
                  });
    }
  }
  return averages;
}

}  // namespace lk::emulator
