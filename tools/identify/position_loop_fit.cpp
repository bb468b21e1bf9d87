#include "tools/identify/position_loop_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unsupported/Eigen/NonLinearOptimization>
#include <unsupported/Eigen/NumericalDiff>

#include "emulator/config/config_checks.hpp"
#include "emulator/config/motor_figures.hpp"
#include "emulator/core/bus/bus.hpp"
#include "emulator/core/servo/registers.hpp"
#include "model/control/motion_loops.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {
namespace {

/// Moves that are looked at: more add little (assumed).
constexpr double kMostMoves_s = 6;
constexpr double kLeastMove_rad = 0.1;
/// A log with longer steps, in times of the loop, does not see how the error dies away; and an
/// emulation that is as far off is not of the same loop (assumed).
constexpr double kLongestStep = 1.6;
constexpr double kFarthest_rad = 0.01;
constexpr double kRadPerCentideg = std::numbers::pi / 18000;
/// Of log gains that nothing is known of: a factor of e either way.
constexpr double kUnknownGain = 1;
constexpr double kStudentMany = 1.96;

SimTime simulated(double seconds) {
  return std::chrono::duration_cast<SimTime>(std::chrono::duration<double>(seconds));
}

/// What is looked for, as logarithms of factors on what is expected; delay in milliseconds more.
/// Inertia, friction and delay are known already, if not quite: how much that matters to the gains
/// shows when they may move, too.
enum Unknown { kAngleKp, kSpeedKp, kSpeedKi, kInertia, kFriction, kDelay, kUnknowns };
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
/// Assumed: a fifth of a millisecond.
constexpr double kDelayDeviation_ms = 0.2;

Eigen::Vector3d gains_of(const ServoConfig& servo) {
  const auto p = model::motion_params(servo.profile.drive, control_settings(servo.rom));
  return {std::log(p.angle_kp), std::log(p.speed_kp), std::log(p.speed_ki)};
}

ServoConfig with(ServoConfig servo, const Unknowns& by) {
  model::ControlParams& c = servo.profile.drive.control;
  c.angle_kp_per_byte *= std::exp(by(kAngleKp));
  c.speed_bandwidth *= std::exp(by(kSpeedKp));
  c.speed_integral_rate *= std::exp(by(kSpeedKi) - by(kSpeedKp));
  model::MechanicsParams& m = servo.profile.drive.mechanics;
  m.J *= std::exp(by(kInertia));
  m.tau_coulomb *= std::exp(by(kFriction));
  m.tau_static *= std::exp(by(kFriction));
  return servo;
}

/// The part of the log that is made again: it begins at rest.
struct Moves {
  std::size_t first = 0, last = 0;  // samples
  double zero_rad = 0;              // multi-turn angle less the angle of the samples
};

/// The largest part without a gap that follows positions only.
std::optional<Moves> moves_of(const Track& track) {
  const auto parts = held_orders(track, Follows::kPosition);
  std::optional<Moves> best;
  std::vector<double> zeros;
  std::size_t first = 0;
  for (std::size_t n = 0; n < parts.size(); ++n) {
    const HeldOrder& part = parts[n];
    if (part.last <= part.first) continue;
    const bool goes_on = n > 0 && parts[n - 1].last == part.first;
    if (!goes_on) zeros.clear();
    if (zeros.empty()) first = part.first;
    zeros.push_back(part.order->value - track.samples[part.last - 1].angle_rad);
    if (track.samples[part.last - 1].time_s - track.samples[first].time_s > kMostMoves_s) {
      zeros.clear();  // the next ones begin where this one ends
      continue;
    }
    if (best && best->last - best->first >= part.last - first) continue;
    std::vector<double> sorted = zeros;
    std::ranges::sort(sorted);
    best = Moves{first, part.last, sorted[sorted.size() / 2]};
  }
  if (!best) return std::nullopt;
  const auto begin = track.samples.begin();
  const auto [low, high] = std::ranges::minmax_element(
      begin + static_cast<std::ptrdiff_t>(best->first),
      begin + static_cast<std::ptrdiff_t>(best->last), {}, &TrackSample::angle_rad);
  if (high->angle_rad - low->angle_rad < kLeastMove_rad) return std::nullopt;
  return best;
}

/// The drive with the mechanics that the balance has found, in Nm with the k_t of its motor file.
ServoConfig with_mechanics(const ServoConfig& servo, const BalanceFit& balance) {
  ServoConfig made = servo;
  model::MechanicsParams& m = made.profile.drive.mechanics;
  const double k = motor_figures(made.profile).k_t_Nm_A;
  const double N = m.gear_ratio;
  const double excess = m.tau_static / std::max(m.tau_coulomb, 1e-9);
  m.J = std::max(balance.inertia_A_s2.value * k - m.J_out / (N * N), 1e-8);
  m.tau_coulomb =
      std::max(balance.coulomb_A.value * k - m.tau_coulomb_out / N / m.gear_efficiency, 0.0);
  m.tau_static = excess * m.tau_coulomb;
  m.B = std::max(balance.viscous_A_s.value * k, 0.0);
  m.tau_cogging = 0;
  for (const Cogging& one : balance.cogging) {
    if (one.order == made.profile.drive.motor.pole_pairs || !is_told(one.amplitude_A)) continue;
    m.tau_cogging = one.amplitude_A.value * k;
    m.cogging_per_turn = one.order;
    break;
  }
  return made;
}

/// Makes the moves with an emulated drive.
class Emulation {
 public:
  Emulation(const Track& track, const BalanceFit& balance, const Moves& moves)
      : track_(track), moves_(moves), delay_s_(balance.delay_s) {
    servo_ = with_mechanics(track.servo, balance);
    model::DriveParams& drive = servo_.profile.drive;
    drive.encoder.noise = 0;
    drive.encoder.inl_1 = 0;
    drive.encoder.inl_2 = 0;
    drive.current_sensor.noise = 0;
    drive.slow_sensor.v_noise = 0;
    if (track.gains) {
      servo_.rom.gains = {track.gains->angle_kp, track.gains->angle_ki, track.gains->speed_kp,
                          track.gains->speed_ki, track.gains->iq_kp,    track.gains->iq_ki};
    }
    // Cogging is where the log has it: A·sin(n·θ + phase) there, sin(n·θ) here.
    double ahead_rad = 0;
    for (const Cogging& one : balance.cogging) {
      if (one.order != drive.mechanics.cogging_per_turn) continue;
      ahead_rad = one.phase_rad / one.order;
      break;
    }
    const double begin_rad = track.samples[moves.first].angle_rad + ahead_rad;
    servo_.boot_angle_deg =
        std::remainder(begin_rad, 2 * std::numbers::pi) * 180 / std::numbers::pi;
  }

  const ServoConfig& servo() const { return servo_; }
  std::size_t count() const { return moves_.last - moves_.first; }
  double logged_rad(std::size_t n) const { return sample(n).angle_rad - sample(0).angle_rad; }
  double time_s(std::size_t n) const { return sample(n).time_s - sample(0).time_s; }

  /// The angle from where it began, at each sample. Of unknowns beyond ±3 as of these.
  std::vector<double> run(const Unknowns& unlimited) const {
    const Unknowns by = unlimited.cwiseMin(3.0).cwiseMax(-3.0);
    const double delay_s = delay_s_ + by(kDelay) * 1e-3;
    BusConfig config;
    config.bitrate = 0;
    config.servos.push_back(with(servo_, by));
    config.servos.front().reply_time = SimTime{0};
    const int id = config.servos.front().id;
    Bus bus(config);
    const auto& format = bus.servo(id).format();
    constexpr double kBoot_s = 0.3;
    bus.advance_to(simulated(kBoot_s));
    const double zero_s = sample(0).time_s - kBoot_s;
    const double start_rad = bus.truth(id).theta_m;
    const auto start_cdeg = std::llround(100 * bus.servo(id).multi_turn_deg(bus.telemetry(id)));
    auto order = std::ranges::upper_bound(track_.orders, sample(0).time_s, {}, &TrackOrder::time_s);
    if (order != track_.orders.begin()) --order;
    std::vector<double> angles_rad;
    for (std::size_t n = 0; n < count(); ++n) {
      const double until_s = sample(n).time_s;
      for (; order != track_.orders.end() && order->time_s + delay_s <= until_s; ++order) {
        const double way_rad = order->value - moves_.zero_rad - sample(0).angle_rad;
        const auto target = start_cdeg + std::llround(way_rad / kRadPerCentideg);
        const auto at = std::max(bus.time(), simulated(order->time_s + delay_s - zero_s));
        bus.receive({at, protocol::encode_query(
                             id,
                             protocol::Position2{.max_speed_dps = std::round(order->limit_rad_s /
                                                                             kRadPerCentideg / 100),
                                                 .target_cdeg = static_cast<std::int32_t>(target)},
                             format)});
      }
      bus.advance_to(std::max(bus.time(), simulated(until_s - zero_s)));
      angles_rad.push_back(bus.truth(id).theta_m - start_rad);
    }
    return angles_rad;
  }

 private:
  const TrackSample& sample(std::size_t n) const { return track_.samples[moves_.first + n]; }

  const Track& track_;
  Moves moves_;
  double delay_s_;
  ServoConfig servo_;
};

/// What is left of the moves, and of what was known of the gains before, in deviations.
struct Residuals {
  using Scalar = double;
  using InputType = Eigen::VectorXd;
  using ValueType = Eigen::VectorXd;
  using JacobianType = Eigen::MatrixXd;
  enum { InputsAtCompileTime = Eigen::Dynamic, ValuesAtCompileTime = Eigen::Dynamic };

  const Emulation* emulation;
  Unknowns expected;
  Unknowns deviation;
  double noise_rad;

  int inputs() const { return kUnknowns; }
  int values() const { return static_cast<int>(emulation->count()) + kUnknowns; }
  /// `at` is one more than the unknowns: Eigen's differences take steps in proportion, here of 1 %.
  int operator()(const Eigen::VectorXd& at, Eigen::VectorXd& left) const {
    const Unknowns by = at.array() - 1;
    const std::vector<double> angles = emulation->run(by);
    for (std::size_t n = 0; n < angles.size(); ++n) {
      left(static_cast<Eigen::Index>(n)) = (angles[n] - emulation->logged_rad(n)) / noise_rad;
    }
    left.tail<kUnknowns>() = (by - expected).cwiseQuotient(deviation);
    return 0;
  }
};

double rms(const Eigen::VectorXd& values) {
  return std::sqrt(values.squaredNorm() / static_cast<double>(values.size()));
}

/// What is left goes on from sample to sample: so many of them tell as much as one that does not.
double correlation_length(const Eigen::VectorXd& left) {
  const Eigen::Index count = left.size();
  double length = 1;
  for (Eigen::Index lag = 1; lag < count / 4; ++lag) {
    const double rho = left.head(count - lag).dot(left.tail(count - lag)) / left.squaredNorm();
    if (rho < 0.05) break;
    length += 2 * rho;
  }
  return length;
}

}  // namespace

std::optional<PositionLoopFit> fit_position_loop(const Track& track, const BalanceFit& balance,
                                                 const SpeedLoopFit& speed) {
  const auto moves = moves_of(track);
  // What hangs on an arm makes the loop sag as a smaller gain would.
  if (!moves || balance.gravity_A) return std::nullopt;
  const Emulation emulation(track, balance, *moves);
  const Eigen::Vector3d before = gains_of(emulation.servo());
  const bool usual = before.array().isFinite().all() &&
                     quality_of(balance.inertia_A_s2) != Quality::kUnknown &&
                     quality_of(balance.coulomb_A) != Quality::kUnknown &&
                     !model_problem(emulation.servo().profile.drive);
  if (!usual) return std::nullopt;  // a gain of 0, or numbers that no motor has
  Residuals residuals{&emulation, Unknowns::Zero(), Unknowns::Constant(kUnknownGain), 1e-3};
  const auto know = [&](Unknown which, const std::optional<Estimate>& told, double log_of_one) {
    if (!told || quality_of(*told) == Quality::kUnknown) return;
    residuals.expected(which) = std::log(told->value) - log_of_one;
    residuals.deviation(which) = told->half_width / told->value / kStudentMany;
  };
  know(kSpeedKp, speed.kp_A_s, before(kSpeedKp));
  know(kSpeedKi, speed.ki_A, before(kSpeedKi));
  know(kInertia, balance.inertia_A_s2, std::log(balance.inertia_A_s2.value));
  know(kFriction, balance.coulomb_A, std::log(balance.coulomb_A.value));
  residuals.deviation(kDelay) = kDelayDeviation_ms;
  Eigen::NumericalDiff<Residuals> differences(residuals, 1e-4);
  Eigen::VectorXd at = residuals.expected.array() + 1;
  Eigen::VectorXd left(residuals.values());
  const auto count = static_cast<Eigen::Index>(emulation.count());
  // Twice: how noisy the log is shows first when it is fitted.
  for (int round = 0; round < 2; ++round) {
    Eigen::LevenbergMarquardt<Eigen::NumericalDiff<Residuals>> solver(differences);
    solver.parameters.maxfev = 60;
    solver.parameters.ftol = 1e-4;
    solver.parameters.xtol = 1e-4;
    solver.minimize(at);
    differences(at, left);
    const double noise = rms(left.head(count)) * std::sqrt(correlation_length(left.head(count)));
    differences.noise_rad *= noise;
  }
  Eigen::MatrixXd jacobian(residuals.values(), int{kUnknowns});
  differences.df(at, jacobian);
  const Unknowns by = at.array() - 1;
  const Eigen::MatrixXd covariance = (jacobian.transpose() * jacobian).inverse();
  PositionLoopFit fit;
  fit.angle_kp_per_s.value = std::exp(before(kAngleKp) + by(kAngleKp));
  fit.angle_kp_per_s.half_width =
      kStudentMany * fit.angle_kp_per_s.value * std::sqrt(covariance(kAngleKp, kAngleKp));
  fit.emulated_rad = emulation.run(by);
  for (std::size_t n = 0; n < emulation.count(); ++n) {
    fit.time_s.push_back(emulation.time_s(n));
    fit.logged_rad.push_back(emulation.logged_rad(n));
    fit.rms_rad += std::pow(fit.emulated_rad[n] - fit.logged_rad[n], 2);
  }
  fit.rms_rad = std::sqrt(fit.rms_rad / static_cast<double>(emulation.count()));
  const bool seen = fit.angle_kp_per_s.value * track.median_step_s <= kLongestStep &&
                    fit.rms_rad <= kFarthest_rad;
  return seen ? std::optional(fit) : std::nullopt;
}

}  // namespace lk::emulator
