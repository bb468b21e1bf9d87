#include "tools/identify/balance_fit.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "emulator/core/servo/shaft_angles.hpp"
#include "tools/identify/balance_regression.hpp"

namespace lk::emulator {
namespace {

using Index = Eigen::Index;
using Windows = std::vector<BalanceWindow>;

constexpr int kHighestOrder = 200;
constexpr std::size_t kMostOrders = 4;
/// By how many variances of the residuals a new order must lower their sum of squares: with 200 to
/// choose from, noise does it once in 10⁷ logs; overlapping windows count twice.
constexpr double kOrderGain = 2 * 43;

Index place(BalanceTerm term) { return static_cast<Index>(term); }

double gravity_of(const Eigen::VectorXd& coefficients) {
  return std::hypot(coefficients(place(BalanceTerm::kGravitySin)),
                    coefficients(place(BalanceTerm::kGravityCos)));
}

/// Which of the terms are looked for.
struct Looked {
  bool constant = true;
  bool viscous = true;
  bool pulses = false;  // for their friction apart
  bool gravity = false;
  bool gear_loss = false;
};

std::vector<Index> used_terms(const Looked& looked, std::size_t orders) {
  std::vector<Index> used{place(BalanceTerm::kInertia), place(BalanceTerm::kCoulomb)};
  if (looked.constant) used.push_back(place(BalanceTerm::kConstant));
  if (looked.viscous) used.push_back(place(BalanceTerm::kViscous));
  if (looked.pulses) used.push_back(place(BalanceTerm::kPulseCoulomb));
  if (looked.pulses && looked.viscous) used.push_back(place(BalanceTerm::kPulseViscous));
  if (looked.gravity) {
    used.push_back(place(BalanceTerm::kGravitySin));
    used.push_back(place(BalanceTerm::kGravityCos));
  }
  if (looked.gear_loss) used.push_back(place(BalanceTerm::kGearLoss));
  for (std::size_t n = 0; n < 2 * orders; ++n) used.push_back(kFixedTerms + static_cast<Index>(n));
  return used;
}

/// Windows that are enough to find an order by; more cost memory (assumed).
constexpr std::size_t kSearchedWindows = 20'000;
std::size_t search_step(const Windows& windows) { return windows.size() / kSearchedWindows + 1; }

/// The order that explains most of what is left; 0: none explains enough.
int next_order(const Windows& windows, const Regression& regression,
               const Eigen::MatrixXcd& averages, const std::vector<int>& known) {
  int best = 0;
  double most = kOrderGain;
  const std::size_t every = search_step(windows);
  for (int order = 1; order <= averages.cols(); ++order) {
    if (std::ranges::find(known, order) != known.end()) continue;
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (std::size_t n = 0; n < windows.size(); n += every) {
      if (!regression.kept(n)) continue;
      const auto average = averages(static_cast<Index>(n / every), order - 1);
      const Eigen::Vector2d row(average.real(), average.imag());
      const double weight = regression.weights().of(windows[n]);
      normal += weight * row * row.transpose();
      right += weight * residual_A(windows[n], regression.coefficients()) * row;
    }
    const double gain = right.dot(normal.completeOrthogonalDecomposition().solve(right));
    if (gain <= most) continue;
    most = gain;
    best = order;
  }
  return best;
}

/// The delay with the least loss, within a few milliseconds: a grid, then a parabola.
double best_delay_s(const Track& track, BalanceShape shape, const std::vector<Index>& used) {
  constexpr double kStep_s = 0.25e-3;
  constexpr int kSteps = 20;
  std::vector<double> loss;
  for (int n = -kSteps / 2; n <= kSteps; ++n) {
    shape.delay_s = n * kStep_s;
    const Windows windows = balance_windows(track, shape);
    if (windows.size() < kFewestWindows) return 0;
    double squares = 0;
    double count = 0;
    const Regression regression(windows, used);
    for (std::size_t k = 0; k < windows.size(); ++k) {
      if (!windows[k].commanded || !regression.kept(k)) continue;
      squares += std::pow(residual_A(windows[k], regression.coefficients()), 2);
      count += 1;
    }
    if (count < kFewestCommanded) return 0;
    loss.push_back(squares / count);
  }
  const auto least = std::ranges::min_element(loss) - loss.begin();
  double between = 0;
  if (least > 0 && least + 1 < std::ssize(loss)) {
    const double before = loss[static_cast<std::size_t>(least) - 1];
    const double here = loss[static_cast<std::size_t>(least)];
    const double after = loss[static_cast<std::size_t>(least) + 1];
    if (before + after > 2 * here) between = 0.5 * (before - after) / (before - 2 * here + after);
  }
  return (static_cast<double>(least) - kSteps / 2 + between) * kStep_s;
}

/// Friction tells its viscous part by being another at another speed, and not while the speed
/// changes: of the windows with little acceleration, the fast ones are so much faster than the slow
/// ones (assumed).
bool has_speeds(const Windows& windows) {
  constexpr double kSpread = 2.5;
  std::vector<std::pair<double, double>> by_acceleration;
  for (const BalanceWindow& w : windows) {
    by_acceleration.emplace_back(std::abs(w.terms(place(BalanceTerm::kInertia))),
                                 std::abs(w.speed_rad_s));
  }
  std::ranges::sort(by_acceleration);
  std::vector<double> speeds;
  for (std::size_t n = 0; n < by_acceleration.size() / 2; ++n) {
    speeds.push_back(by_acceleration[n].second);
  }
  std::ranges::sort(speeds);
  return speeds[speeds.size() * 9 / 10] > kSpread * speeds[speeds.size() / 10];
}

/// Friction changes its sign with the speed, and an offset does not: of a shaft that turns one way
/// only, they cannot be told apart. A tenth of the windows turn the other way (assumed).
bool turns_both_ways(const Windows& windows) {
  const auto one_way =
      std::ranges::count_if(windows, [](const BalanceWindow& w) { return w.speed_rad_s > 0; });
  const double share = static_cast<double>(one_way) / static_cast<double>(windows.size());
  return share > 0.1 && share < 0.9;
}

/// Far enough for gravity to show, at angles that are known: across a gap turns of the rotor may be
/// lost, which does not matter where the encoder counts those of the output.
bool output_turned_far(const Track& track) {
  const double N = track.servo.profile.drive.mechanics.gear_ratio;
  const bool known =
      stretches(track).size() == 1 || encoder_turns(track.servo.profile, track.servo.quirks) == N;
  if (!known) return false;
  const auto [low, high] = std::ranges::minmax_element(track.samples, {}, &TrackSample::angle_rad);
  return (high->angle_rad - low->angle_rad) / N >= kGravityTravel_rad;
}

/// In deviations, without the largest hundredth: lines that the log has lost.
double trimmed_rms(const Windows& windows, const Regression& regression) {
  std::vector<double> left;
  for (const BalanceWindow& w : windows) {
    left.push_back(std::sqrt(regression.weights().of(w)) *
                   std::abs(residual_A(w, regression.coefficients())));
  }
  const auto kept = left.size() - left.size() / 100;
  std::ranges::nth_element(left, left.begin() + static_cast<std::ptrdiff_t>(kept) - 1);
  double squares = 0;
  for (std::size_t n = 0; n < kept; ++n) squares += left[n] * left[n];
  return std::sqrt(squares / static_cast<double>(kept));
}

/// Of the windows that the fit has kept, or would have, each in its own deviations.
double rms_A(const Windows& windows, const Regression& regression) {
  double squares = 0;
  double sum = 0;
  for (std::size_t n = 0; n < windows.size(); ++n) {
    if (!regression.kept(n)) continue;
    const double weight = regression.weights().of(windows[n]);
    squares += weight * std::pow(residual_A(windows[n], regression.coefficients()), 2);
    sum += weight;
  }
  return std::sqrt(squares / sum);
}

/// Each half, of every other run of windows, is fitted and tried on the other: what is left there,
/// over what is left where it was fitted.
double held_out_ratio(const Windows& windows, const std::vector<Index>& used) {
  Windows halves[2];
  for (std::size_t n = 0; n < windows.size(); ++n)
    halves[n / kRunOfWindows % 2].push_back(windows[n]);
  double held_out = 0;
  double fitted = 0;
  for (const Windows& half : halves) {
    const Regression regression(half, used);
    const Windows& other = &half == halves ? halves[1] : halves[0];
    fitted += std::pow(trimmed_rms(half, regression), 2);
    held_out += std::pow(trimmed_rms(other, regression), 2);
  }
  return std::sqrt(held_out / fitted);
}

/// The autocorrelation of what is left in windows that follow each other and share no sample.
double autocorrelation(const Windows& windows, const Regression& regression) {
  const auto left = [&](std::size_t n) {
    return std::sqrt(regression.weights().of(windows[n])) *
           residual_A(windows[n], regression.coefficients());
  };
  double products = 0;
  double squares = 0;
  for (std::size_t n = 0; n + 2 < windows.size(); ++n) {
    const bool follows = windows[n + 2].first == windows[n].last;
    if (!follows || !regression.kept(n) || !regression.kept(n + 2)) continue;
    products += left(n) * left(n + 2);
    squares += left(n) * left(n);
  }
  return squares > 0 ? products / squares : 0;
}

BalanceFit estimates(const Windows& windows, const std::vector<Index>& used, const Looked& looked,
                     const BalanceShape& shape) {
  BalanceFit fit;
  const Regression regression(windows, used);
  const auto without = regression.jackknife();
  const auto of = [&](auto function) { return regression.estimate(without, function); };
  const auto coefficient = [&](BalanceTerm term) {
    return of([term](const auto& c) { return c(place(term)); });
  };
  fit.inertia_A_s2 = coefficient(BalanceTerm::kInertia);
  fit.coulomb_A = coefficient(BalanceTerm::kCoulomb);
  fit.viscous_A_s = coefficient(BalanceTerm::kViscous);
  if (!looked.constant) fit.coulomb_A.half_width = fit.coulomb_A.value;
  if (!looked.viscous) {
    // What of it grows with the speed is in it: a tenth, assumed.
    fit.coulomb_A.half_width = std::hypot(fit.coulomb_A.half_width, 0.1 * fit.coulomb_A.value);
  }
  if (looked.gravity) fit.gravity_A = of(gravity_of);
  if (looked.gear_loss) {
    fit.gear_loss =
        of([](const auto& c) { return c(place(BalanceTerm::kGearLoss)) / gravity_of(c); });
  }
  fit.gravity_phase_rad = shape.gravity_phase_rad;
  fit.coefficients = regression.coefficients();
  for (std::size_t n = 0; n < shape.orders.size(); ++n) {
    const Index at = kFixedTerms + 2 * static_cast<Index>(n);
    fit.cogging.push_back({shape.orders[n],
                           of([at](const auto& c) { return std::hypot(c(at), c(at + 1)); }),
                           std::atan2(fit.coefficients(at), fit.coefficients(at + 1))});
  }
  std::ranges::sort(fit.cogging, std::greater{},
                    [](const Cogging& one) { return one.amplitude_A.value; });
  fit.delay_s = shape.delay_s;
  fit.check = {windows.size(),
               static_cast<std::size_t>(std::ranges::count_if(
                   windows, [](const BalanceWindow& w) { return w.commanded; })),
               rms_A(windows, regression), held_out_ratio(windows, used),
               autocorrelation(windows, regression)};
  return fit;
}

/// What the windows do not see of the inertia. Where torques were commanded: the current rises
/// along a curve, where a delay is fitted, and stamps are late (1 %, assumed). Where they were not,
/// a current may have come and gone between two samples (a half, assumed). Within the play of a
/// gear, and in short pulses, the flange of the output hangs on the rotor or does not.
void widen_inertia(const Track& track, std::size_t commanded, Estimate& inertia) {
  const double unseen = commanded >= kFewestCommanded ? 0.01 : 0.5;
  const model::MechanicsParams& m = track.servo.profile.drive.mechanics;
  const double flange =
      m.gear_ratio > 1 ? m.J_out / (m.gear_ratio * m.gear_ratio * m.J + m.J_out) : 0.0;
  inertia.half_width =
      std::hypot(inertia.half_width, unseen * inertia.value, flange / 2 * inertia.value);
}

/// The acceleration of a window with measured currents is smoother than the rotor's: of a ripple it
/// sees sinc²(frequency · half a window). Half of the rest may have gone to the inertia unseen
/// (assumed). Windows count by what they tell of the ripple.
void widen_cogging(const Track& track, const Windows& windows, const std::vector<int>& orders,
                   std::vector<Cogging>& cogging) {
  const double half_s = std::max(kHalfWindow_s, track.median_step_s);
  for (Cogging& one : cogging) {
    const auto place = kFixedTerms + 2 * (std::ranges::find(orders, one.order) - orders.begin());
    double unseen = 0;
    double sum = 0;
    for (const BalanceWindow& w : windows) {
      const double tells = w.terms.segment(place, 2).squaredNorm();
      const double x = one.order * std::abs(w.speed_rad_s) * half_s / 2;  // π times both
      if (!w.commanded) unseen += tells * (1 - std::pow(std::sin(x) / x, 2));
      sum += tells;
    }
    one.amplitude_A.half_width =
        std::hypot(one.amplitude_A.half_width, unseen / sum / 2 * one.amplitude_A.value);
  }
}

}  // namespace

std::optional<BalanceFit> fit_balance(const Track& track) {
  BalanceShape shape;
  Windows windows = balance_windows(track, shape);
  if (windows.size() < kFewestWindows) return std::nullopt;
  const bool geared = track.servo.profile.drive.mechanics.gear_ratio > 1;
  const auto commanded = static_cast<std::size_t>(
      std::ranges::count_if(windows, [](const BalanceWindow& w) { return w.commanded; }));
  Looked looked{.constant = turns_both_ways(windows),
                .viscous = has_speeds(windows),
                .pulses = geared && commanded >= kFewestCommanded &&
                          windows.size() - commanded >= kFewestCommanded,
                .gravity = output_turned_far(track)};
  shape.delay_s = best_delay_s(track, shape, used_terms(looked, 0));
  windows = balance_windows(track, shape);
  const Eigen::MatrixXcd averages =
      order_averages(track, windows, search_step(windows), kHighestOrder);
  while (shape.orders.size() < kMostOrders) {
    const Regression regression(windows, used_terms(looked, shape.orders.size()));
    const int order = next_order(windows, regression, averages, shape.orders);
    if (order == 0) break;
    shape.orders.push_back(order);
    windows = balance_windows(track, shape);
  }
  if (looked.gravity) {
    // Where there is none, what a gear takes of it looks like friction.
    const Regression regression(windows, used_terms(looked, shape.orders.size()));
    const Eigen::VectorXd& c = regression.coefficients();
    looked.gravity =
        quality_of(regression.estimate(regression.jackknife(), gravity_of)) != Quality::kUnknown;
    looked.gear_loss = looked.gravity && geared;
    shape.gravity_phase_rad =
        std::atan2(c(place(BalanceTerm::kGravityCos)), c(place(BalanceTerm::kGravitySin)));
  }
  const auto used = used_terms(looked, shape.orders.size());
  shape.delay_s = best_delay_s(track, shape, used);
  windows = balance_windows(track, shape);
  BalanceFit fit = estimates(windows, used, looked, shape);
  widen_inertia(track, fit.check.commanded, fit.inertia_A_s2);
  widen_cogging(track, windows, shape.orders, fit.cogging);
  fit.windows = std::move(windows);
  return fit;
}

}  // namespace lk::emulator
