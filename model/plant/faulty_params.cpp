#include "model/plant/faulty_params.hpp"

#include <algorithm>
#include <cmath>

#include "model/noise.hpp"
#include "model/rounding.hpp"

namespace lk::model {
namespace {

constexpr double kLocked = 1e12;  // Nm: more than any torque on a shaft

void add_mechanical(const Faults& f, double jam_torque, MechanicsParams& m, LoadParams& load) {
  m.tau_coulomb *= f.friction;
  m.tau_static *= f.friction;
  m.B *= f.friction;
  m.tau_coulomb_out *= f.friction;
  m.tau_coulomb_out += f.jam < 1.0 ? f.jam * jam_torque : kLocked;
  m.J *= f.inertia;
  m.J_out *= f.inertia;
  m.backlash_out *= f.backlash;
  load.J *= f.inertia;
  load.tau += f.load_torque;
  load.theta_min = std::max(load.theta_min, f.theta_min);
  load.theta_max = std::min(load.theta_max, f.theta_max);
}

void add_sensors(const Faults& f, EncoderParams& encoder, CurrentSensorParams& current) {
  // Computes no square root without additional noise: results of a healthy drive keep their bits.
  const auto add_noise = [](double more, double& noise) {
    noise = more > 0.0 ? std::sqrt(noise * noise + more * more) : noise;
  };
  encoder.offset += f.encoder_offset;
  encoder.latency += f.encoder_latency;
  add_noise(f.encoder_noise, encoder.noise);
  current.gain_a *= f.current_a.gain;
  current.gain_b *= f.current_b.gain;
  current.offset_a = f.current_a.gain * current.offset_a + f.current_a.offset;
  current.offset_b = f.current_b.gain * current.offset_b + f.current_b.offset;
  add_noise(f.current_noise, current.noise);
}

/// Returns the reading of a stuck current channel, rounded to an LSB of its ADC, A.
std::optional<double> stuck_channel(const DriveParams& d, const Faults::Current& fault) {
  if (!fault.stuck || !d.control.has_current_loop) {
    return std::nullopt;
  }
  const CurrentSensorParams& s = d.current_sensor;
  const double lsb = 2.0 * s.range / static_cast<double>(1 << s.bits);
  return nearest(std::clamp(*fault.stuck, -s.range, s.range) / lsb) * lsb;
}

}  // namespace

double jam_torque(const DriveParams& drive) {
  const double k_t = 1.5 * drive.motor.pole_pairs * drive.motor.psi_f;
  return k_t * drive.current_sensor.range * drive.mechanics.gear_ratio;
}

DriveParams with_faults(const DriveParams& drive, const Faults& faults) {
  DriveParams result = drive;
  add_mechanical(faults, jam_torque(drive), result.mechanics, result.load);
  add_sensors(faults, result.encoder, result.current_sensor);
  result.thermal.R_housing_ambient *= faults.R_housing_ambient;
  result.supply.v_source = std::min(result.supply.v_source, faults.v_source_max);
  if (faults.no_regeneration) {
    result.supply.i_regen_max = 0.0;
  }
  return result;
}

DriveParams by_own_clock(const DriveParams& drive, const Faults& faults) {
  DriveParams result = drive;
  result.inverter.f_pwm /= faults.clock_ratio;
  return result;
}

LaneFaults lane_faults(const DriveParams& drive, const Faults& faults, const LaneFaults& before,
                       double shown_counts, std::uint64_t seed) {
  LaneFaults result;
  if (faults.encoder == before.encoder) {
    result = before;
  } else {
    result.encoder = faults.encoder;
    result.held_counts = shown_counts;
    result.counts_per_turn = static_cast<double>(1 << drive.encoder.bits);
    result.noise = noise_seed(seed);
  }
  result.i_a = stuck_channel(drive, faults.current_a);
  result.i_b = stuck_channel(drive, faults.current_b);
  result.bridge_dead = faults.bridge_dead;
  result.legs = faults.legs;
  return result;
}

}  // namespace lk::model
