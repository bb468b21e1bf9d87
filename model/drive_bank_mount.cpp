// An output shaft on a body that is computed elsewhere (docs/decisions/0031).
#include <cassert>

#include "model/block_access.hpp"
#include "model/drive_bank_state.hpp"
#include "model/plant/faulty_params.hpp"
#include "model/plant/stored_energy.hpp"
#include "model/stored_real.hpp"

namespace lk::model {
void DriveBank::mount(std::size_t drive, const Mount& mount) {
  assert(mount.J > 0.0);
  State::Unit& unit = state_->units[drive];
  const double stored_before = energy(drive).stored;
  unit.mounted = true;
  unit.params.load = {.J = mount.J, .tau = mount.tau};
  const MechanicsParams mechanics = with_faults(unit.params, unit.faults).mechanics;
  state_->with_block(drive, [&](auto& block, std::size_t lane) {
    // Of the plant's numbers these alone are others: all of them take too long, so often.
    auto& p = block.plant_params;
    const bool compliant = lane_of(p.compliant, lane) != 0.0;
    const Inertia inertia = inertia_of(mechanics, mount.J, compliant, lane_of(p.f_s, lane));
    lane_of(p.inertia_rate, lane) = inertia.rate;
    lane_of(p.inertia_rate_out, lane) = inertia.rate_out;
    lane_of(p.mobility, lane) = inertia.mobility;
    lane_of(p.mobility_out, lane) = inertia.mobility_out;
    lane_of(p.tau_load, lane) = mount.tau + unit.faults.load_torque;
    lane_of(block.plant.theta_out, lane) = mount.theta_out + unit.mounted_at;
    lane_of(block.plant.omega_out, lane) = mount.omega_out;
    if (!compliant) {
      const double ratio = lane_of(p.gear_ratio, lane);
      lane_of(block.plant.theta, lane) = (mount.theta_out + unit.mounted_at) * ratio;
      lane_of(block.plant.omega, lane) = mount.omega_out * ratio;
    }
    const double stored = stored_energy(get<PlantParams<double>>(p, lane),
                                        get<PlantState<double>>(block.plant, lane));
    lane_of(block.plant.p_load, lane) -= (stored - stored_before) * lane_of(p.f_s, lane);
  });
}

MountedShaft DriveBank::mounted_shaft(std::size_t drive) const {
  const State::Unit& unit = state_->units[drive];
  const MechanicsParams mechanics = with_faults(unit.params, unit.faults).mechanics;
  return state_->with_block(drive, [&](const auto& block, std::size_t lane) {
    const bool compliant = lane_of(block.plant_params.compliant, lane) != 0.0;
    const double rotor = mechanics.J * mechanics.gear_ratio * mechanics.gear_ratio;
    return MountedShaft{lane_of(block.plant.theta_out, lane) - unit.mounted_at,
                        lane_of(block.plant.omega_out, lane),
                        mechanics.J_out + (compliant ? 0.0 : rotor)};
  });
}

}  // namespace lk::model
