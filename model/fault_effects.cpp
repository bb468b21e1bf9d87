#include "model/fault_effects.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <tuple>

namespace lk::model {
namespace {

// Smallest changes of shaft motion that count as an effect (assumed); far above rounding errors.
constexpr double kSpeedStep = 1e-7;  // rad/s within a period
constexpr double kAngleStep = 1e-9;  // rad
// Smallest temperature change that counts (assumed): more than one LSB of current causes in a
// period, and a thousandth of what the rated torque causes.
constexpr double kHeatStep = 1e-6;  // K within a period
// Smallest change of a heat flow that counts (assumed): a hundredth of an encoder's power, and a
// billion times the rounding errors.
constexpr double kHeatFlowStep = 1e-3;  // W
/// For states that are not compared: other states then differ, now or a period later.
constexpr double kFollows = HUGE_VAL;

/// Largest value of normal_deviate(), a sum of four 16-bit numbers (noise.hpp).
constexpr double kLargestDeviate = 3.4642;

PlantState<double> after(const Period& period) {
  const PlantParams<double>& p = period.plant;
  PlantState<double> s = period.state;
  const SinCos<double> theta_e = sincos<double>(p.pole_pairs * s.theta);
  const Abc<double> i_abc = inverse_clarke(inverse_park(Dq<double>{s.i_d, s.i_q}, theta_e));
  const CurrentLoopState<double>& loop = period.loop;
  advance<kFaultyParts, double>(p, s, {loop.duty_a, loop.duty_b, loop.duty_c},
                                period.faults.bridge_dead ? 0.0 : loop.bridge, i_abc, theta_e,
                                &period.faults);
  return s;
}

Measurement<double> shown(const Period& period) {
  PlantParams<double> p = period.plant;
  p.encoder_noise = 0.0;
  p.current_noise = 0.0;
  const PlantState<double>& s = period.state;
  const SinCos<double> theta_e = sincos<double>(p.pole_pairs * s.theta);
  const Abc<double> i_abc = inverse_clarke(inverse_park(Dq<double>{s.i_d, s.i_q}, theta_e));
  std::uint64_t unused = 1;
  LaneFaults faults = period.faults;
  return falsified(faults, measure<double>(p, i_abc, s.theta, s.omega, unused));
}

/// Returns the heat flows winding → housing, housing → ambient and stage → ambient, W.
std::array<double, 3> heat_flows(const Period& period) {
  const PlantParams<double>& p = period.plant;
  const PlantState<double>& s = period.state;
  return {(s.temp_winding - s.temp_housing) * p.g_winding_housing,
          (s.temp_housing - p.temp_ambient) * p.g_housing_ambient,
          (s.temp_stage - p.temp_ambient) * p.g_stage_ambient};
}

/// Returns all state variables of a plant.
auto values(const PlantState<double>& state) {
  return std::apply([](const auto&... each) { return std::array{each...}; }, fields(state));
}

/// Returns true if the additional noise can reach `step`.
bool noise_shows(double with, double without, double step) {
  return kLargestDeviate * std::sqrt(std::max(with * with - without * without, 0.0)) >= step;
}

}  // namespace

bool plants_differ(const Period& with, const Period& without, const SlowSensors& steps) {
  const PlantState<double> a = after(with);
  const PlantState<double> b = after(without);
  const double i_step = without.plant.current_lsb;
  // Smallest difference that counts, for each plant state in the order of fields(). The rotor's
  // angle follows from its speed; a disconnected output may have any angle.
  const auto differences =
      std::array{i_step,     i_step,      kFollows,    // i_d, i_q, theta
                 kSpeedStep, kAngleStep,  kSpeedStep,  // omega, theta_out, omega_out
                 kFollows,   steps.v_lsb, kFollows,    // omega_change, v_link, i_link
                 kHeatStep,  kHeatStep,   kHeatStep,   // winding, housing, stage
                 kFollows,                             // tau_e
                 kFollows,   kFollows,    kFollows,    // energy ledger
                 kFollows,   kFollows,    kFollows};
  const auto one = values(a);
  const auto other = values(b);
  static_assert(one.size() == differences.size(), "each state of the plant has its step");
  for (std::size_t n = 0; n < one.size(); ++n) {
    if (std::abs(one[n] - other[n]) >= differences[n]) return true;
  }
  return false;
}

bool heat_flows_differ(const Period& with, const Period& without) {
  const auto one = heat_flows(with);
  const auto other = heat_flows(without);
  for (std::size_t n = 0; n < one.size(); ++n) {
    if (std::abs(one[n] - other[n]) >= kHeatFlowStep) return true;
  }
  return false;
}

bool measurements_differ(const Period& with, const Period& without) {
  const PlantParams<double>& p = without.plant;
  const Measurement<double> a = shown(with);
  const Measurement<double> b = shown(without);
  // A stuck encoder may hold a reading that contains noise.
  const double held_noise =
      with.faults.encoder == EncoderFault::kStuck ? kLargestDeviate * p.encoder_noise : 0.0;
  const double counts_step = 1.0 + held_noise * p.counts_per_rad;
  // Both readings are multiples of current_lsb.
  const double i_step = 0.5 * p.current_lsb;
  return std::abs(a.encoder_counts - b.encoder_counts) >= counts_step ||
         std::abs(a.i_a - b.i_a) >= i_step || std::abs(a.i_b - b.i_b) >= i_step ||
         noise_shows(with.plant.encoder_noise, p.encoder_noise, 1.0 / p.counts_per_rad) ||
         noise_shows(with.plant.current_noise, p.current_noise, p.current_lsb);
}

bool slow_measurements_differ(const Faults& faults, const PlantState<double>& state,
                              const SlowSensors& sensors) {
  SlowSensors silent = sensors;
  silent.v_noise = 0.0;
  std::uint64_t unused = 1;
  const SlowMeasurement healthy = measure_slowly(
      silent, state.v_link, {state.temp_winding, state.temp_housing, state.temp_stage}, unused);
  const SlowMeasurement shown = falsified(sensors, faults, healthy);
  return std::abs(shown.v_bus - healthy.v_bus) >= 0.5 * sensors.v_lsb ||
         std::abs(shown.temp_motor - healthy.temp_motor) >= 0.5 * sensors.temp_lsb ||
         std::abs(shown.temp_driver - healthy.temp_driver) >= 0.5 * sensors.temp_lsb;
}

}  // namespace lk::model
