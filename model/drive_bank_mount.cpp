// Coupling of an output shaft to a body simulated elsewhere (docs/internals/decisions/0031).
#include <cassert>
#include <cmath>

#include "model/block_access.hpp"
#include "model/drive_bank_state.hpp"
#include "model/plant/faulty_params.hpp"
#include "model/plant/stored_energy.hpp"
#include "model/stored_real.hpp"

namespace lk::model {
namespace {

/// rad, rad/s: largest rounding error of a joint's angle and speed in the body simulation.
constexpr double kRounding = 1e-12;

/// Moves the joint to the body's angle `theta` and speed `omega`. If the rotor is part of the
/// joint, keeps the twist between rotor and output. Ignores changes within rounding: for the
/// friction model, a shaft at rest must stay exactly at rest.
template <class State, class Joint>
void move(State& plant, std::size_t lane, double ratio, const Joint& joint, double theta,
          double omega) {
  if (std::abs(theta - joint.theta) < kRounding && std::abs(omega - joint.omega) < kRounding) {
    return;
  }
  const double rotor_share = joint.rotor_share;
  double& theta_m = lane_of(plant.theta, lane);
  double& omega_m = lane_of(plant.omega, lane);
  double& theta_out = lane_of(plant.theta_out, lane);
  double& omega_out = lane_of(plant.omega_out, lane);
  const double twist = theta_m / ratio - theta_out;
  const double twist_rate = omega_m / ratio - omega_out;
  theta_out = theta - rotor_share * twist;
  omega_out = omega - rotor_share * twist_rate;
  if (rotor_share > 0.0) {
    theta_m = (theta + (1.0 - rotor_share) * twist) * ratio;
    omega_m = (omega + (1.0 - rotor_share) * twist_rate) * ratio;
  }
}

}  // namespace

DriveBank::State::Joint DriveBank::State::joint(std::size_t drive) const {
  const Unit& unit = units[drive];
  const MechanicsParams& p = unit.params.mechanics;
  const double rotor = unit.faults.inertia * p.J * p.gear_ratio * p.gear_ratio;
  const double flange = unit.faults.inertia * p.J_out;
  const bool springy = p.gear_stiffness_out > 0.0;
  const bool apart = unit.faults.coupling_broken || (springy && !unit.mounted_stiff);
  // Rigid gear: rotor and output have the same angle.
  double share = springy ? rotor / (rotor + flange + unit.params.load.J) : 1.0;
  if (apart) share = 0.0;
  return with_block(drive, [&](const auto& block, std::size_t lane) {
    const double theta_out = lane_of(block.plant.theta_out, lane);
    const double omega_out = lane_of(block.plant.omega_out, lane);
    const double twist = lane_of(block.plant.theta, lane) / p.gear_ratio - theta_out;
    const double twist_rate = lane_of(block.plant.omega, lane) / p.gear_ratio - omega_out;
    return Joint{theta_out + share * twist, omega_out + share * twist_rate, share,
                 flange + (apart ? 0.0 : rotor)};
  });
}

void DriveBank::mount(std::size_t drive, const Mount& mount) {
  assert(mount.J > 0.0);
  State::Unit& unit = state_->units[drive];
  const double stored_before = energy(drive).stored;
  unit.mounted = true;
  unit.mounted_stiff = mount.stiff;
  unit.params.load = {.J = mount.J, .tau = mount.tau};
  if (mount.posed) {
    turn_shaft(drive, mount.theta + unit.mount_offset - state_->joint(drive).theta);
    state_->with_block(drive, [](auto& block, std::size_t lane) {
      lane_of(block.plant.omega, lane) = 0.0;
      lane_of(block.plant.omega_out, lane) = 0.0;
    });
  }
  const State::Joint joint = state_->joint(drive);
  const MechanicsParams mechanics = with_faults(unit.params, unit.faults).mechanics;
  state_->with_block(drive, [&](auto& block, std::size_t lane) {
    // Updates only the parameters that change: deriving all of them on every call is too slow.
    auto& p = block.plant_params;
    const bool compliant = lane_of(p.compliant, lane) != 0.0;
    const Inertia inertia = inertia_of(mechanics, mount.J, compliant, lane_of(p.f_s, lane));
    lane_of(p.inertia_rate, lane) = inertia.rate;
    lane_of(p.inertia_rate_out, lane) = inertia.rate_out;
    lane_of(p.mobility, lane) = inertia.mobility;
    lane_of(p.mobility_out, lane) = inertia.mobility_out;
    lane_of(p.tau_load, lane) = mount.tau + unit.faults.load_torque;
    move(block.plant, lane, mechanics.gear_ratio, joint, mount.theta + unit.mount_offset,
         mount.omega);
    const double stored = stored_energy(get<PlantParams<double>>(p, lane),
                                        get<PlantState<double>>(block.plant, lane));
    lane_of(block.plant.p_load, lane) -= (stored - stored_before) * lane_of(p.f_s, lane);
  });
}

MountedShaft DriveBank::mounted_shaft(std::size_t drive) const {
  const State::Joint joint = state_->joint(drive);
  return {joint.theta - state_->units[drive].mount_offset, joint.omega, joint.armature};
}

}  // namespace lk::model
