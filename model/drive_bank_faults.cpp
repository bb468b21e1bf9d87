// Fault functions of DriveBank.
#include <algorithm>

#include "model/block_access.hpp"
#include "model/drive_bank_state.hpp"
#include "model/fault_effects.hpp"
#include "model/plant/faulty_params.hpp"
#include "model/plant/stored_energy.hpp"
#include "model/stored_real.hpp"

namespace lk::model {
namespace {

/// Returns the reading of a healthy encoder without noise, counts.
double counts_without_noise(PlantParams<double> p, const PlantState<double>& s) {
  p.encoder_noise = 0.0;
  std::uint64_t unused = 1;
  return encoder(p, s.theta, s.omega, unused);
}

/// Clamps a rotor speed to ±ω_max.
double held(const PlantParams<double>& p, double omega) {
  return std::clamp(omega, -p.omega_max, p.omega_max);
}

/// Reconnects rotor and output: moves the output to the rotor's angle. With a rigid gear, gives
/// both the speed that conserves their momentum. `J_rotor`: inertia of the rotor alone, kg·m².
void join(const PlantParams<double>& p, double J_rotor, PlantState<double>& s) {
  s.theta_out = s.theta * p.inv_gear;
  if (p.compliant == 0.0) {
    const double rotor_share = J_rotor / (p.inertia_rate * p.T_s);
    s.omega = held(p, s.omega + (1.0 - rotor_share) * (s.omega_out * p.gear_ratio - s.omega));
    s.omega_out = s.omega * p.inv_gear;
  }
}

}  // namespace

void DriveBank::set_faults(std::size_t drive, const Faults& faults) {
  State::Unit& unit = state_->units[drive];
  if (faults == unit.faults) {
    return;
  }
  const Faults before = unit.faults;
  const double stored_before = energy(drive).stored;
  const double joint_before = state_->joint(drive).theta;
  unit.faults = faults;
  unit.slow_sensors_faulty = slow_sensors_faulty(faults);
  state_->derive_plant(drive);
  state_->derive_control(drive);
  state_->with_block(drive, [&](auto& block, std::size_t lane) {
    const auto p = get<PlantParams<double>>(block.plant_params, lane);
    auto s = get<PlantState<double>>(block.plant, lane);
    if (before.coupling_broken && !faults.coupling_broken) {
      join(p, with_faults(unit.params, faults).mechanics.J, s);
    }
    s.p_load -= (stored_energy(p, s) - stored_before) * p.f_s;
    put(block.plant, lane, s);

    double& counts = lane_of(block.loop.encoder_counts, lane);
    if (before.encoder != EncoderFault::kNone && faults.encoder == EncoderFault::kNone) {
      // The encoder shows the true angle again; the estimator must not see the jump as speed.
      counts = counts_without_noise(p, s);
      accept_encoder_jump(unit.motion_params, counts, unit.motion);
    }
    block.faults[lane] =
        lane_faults(unit.params, faults, block.faults[lane], counts, unit.slow_noise);
    block.faulty = any_faulty(block);
  });
  // Reconnecting a coupling may move the joint. The body keeps its angle, so the offset changes.
  if (unit.mounted) unit.mount_offset += state_->joint(drive).theta - joint_before;
}

bool DriveBank::takes_effect(std::size_t drive, const Faults& one) const {
  const State::Unit& unit = state_->units[drive];
  const bool alive = unit.life.life == Life::kAlive;
  const PlantParams<double> faulty = State::plant_of(unit, one);
  const PlantParams<double> healthy = State::plant_of(unit, Faults{});
  return state_->with_block(drive, [&](const auto& block, std::size_t lane) {
    const auto s = get<PlantState<double>>(block.plant, lane);
    const auto loop = get<CurrentLoopState<double>>(block.loop, lane);
    // Assumes that an encoder fault that is not active starts now.
    const LaneFaults lane_of_one =
        lane_faults(unit.params, one, block.faults[lane], loop.encoder_counts, 1);
    const LaneFaults none;
    const Period with{faulty, s, loop, lane_of_one};
    const Period without{healthy, s, loop, none};
    const bool follows = std::holds_alternative<Speed>(unit.setpoint) ||
                         std::holds_alternative<Position>(unit.setpoint);
    const bool times = unit.life.life == Life::kBooting || (alive && (follows || s.omega != 0.0));
    // A commutation offset has no effect without current.
    const bool commutates = alive && loop.bridge != 0.0 && (loop.i_d != 0.0 || loop.i_q != 0.0);
    return plants_differ(with, without, unit.slow_sensors) || heat_flows_differ(with, without) ||
           (one.commutation_offset != 0.0 && commutates) ||
           (unit.params.brake.tau > 0.0 && unit.brake.waits(one.brake_delay)) ||
           (alive && (measurements_differ(with, without) ||
                      slow_measurements_differ(one, s, unit.slow_sensors))) ||
           (one.clock_ratio != 1.0 && times);
  });
}

void DriveBank::kick(std::size_t drive, double impulse) {
  state_->with_block(drive, [&](auto& block, std::size_t lane) {
    const auto p = get<PlantParams<double>>(block.plant_params, lane);
    auto s = get<PlantState<double>>(block.plant, lane);
    const double stored_before = stored_energy(p, s);
    if (p.compliant != 0.0) {
      s.omega_out += impulse * p.f_s * p.mobility_out;
    } else {
      s.omega = held(p, s.omega + impulse * p.f_s * p.inv_gear / p.inertia_rate);
      s.omega_out = s.omega * p.inv_gear;
    }
    s.p_load -= (stored_energy(p, s) - stored_before) * p.f_s;
    put(block.plant, lane, s);
  });
}

}  // namespace lk::model
