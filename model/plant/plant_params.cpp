#include "model/plant/plant_params.hpp"

#include <algorithm>
#include <cassert>

#include "model/trig.hpp"

namespace lk::model {
namespace {

/// rad, largest electrical turn of the rotor in a period. From 2.3 on, the power series of
/// motor.hpp would let currents grow without bound. A motor at its fastest has 0.5, and a rotor
/// would burst before 2.
constexpr double kMaxTurn = 2.0;

void set_electrical(PlantParams<double>& p, const DriveParams& d) {
  p.T_s = 1.0 / d.inverter.f_pwm;
  p.f_s = d.inverter.f_pwm;
  p.pole_pairs = d.motor.pole_pairs;
  p.R_25 = d.motor.R_s;
  p.alpha_cu = d.motor.alpha_cu;
  p.psi_25 = d.motor.psi_f;
  p.alpha_pm = d.motor.alpha_pm;
  p.torque_ripple = d.motor.torque_ripple;
  p.L_d = d.motor.L_d;
  p.L_q = d.motor.L_q;
  p.T_by_L_d = p.T_s / d.motor.L_d;
  p.T_by_L_q = p.T_s / d.motor.L_q;
  p.L_d_by_L_q = d.motor.L_d / d.motor.L_q;
  p.L_q_by_L_d = d.motor.L_q / d.motor.L_d;
  p.dead_fraction = d.inverter.t_dead * d.inverter.f_pwm;
  p.dead_drop = 2.0 * p.dead_fraction * d.inverter.v_diode;
  p.inv_i_dead_zone = 1.0 / d.inverter.i_dead_zone;
  p.R_on = d.inverter.R_on;
  p.v_diode = d.inverter.v_diode;
}

void set_mechanical(PlantParams<double>& p, const DriveParams& d, bool coupled) {
  const MechanicsParams& m = d.mechanics;
  const bool compliant = !coupled || m.gear_stiffness_out > 0.0;
  const Inertia inertia = inertia_of(m, d.load.J, compliant, p.f_s);
  assert(inertia.rate > 0.0 && (!compliant || !coupled || inertia.rate_out > 0.0));
  p.gear_ratio = m.gear_ratio;
  p.inv_gear = 1.0 / m.gear_ratio;
  p.inertia_rate = inertia.rate;
  p.B_half = 0.5 * m.B;
  p.mobility = inertia.mobility;
  p.omega_max = kMaxTurn * p.f_s / d.motor.pole_pairs;
  p.inertia_rate_out = inertia.rate_out;
  p.mobility_out = inertia.mobility_out;
  p.tau_coulomb = m.tau_coulomb + (compliant ? 0.0 : m.tau_coulomb_out / m.gear_ratio);
  p.tau_static_excess = m.tau_static > m.tau_coulomb ? m.tau_static - m.tau_coulomb : 0.0;
  p.inv_omega_stribeck2 = 1.0 / (m.omega_stribeck * m.omega_stribeck);
  p.tau_coulomb_out = m.tau_coulomb_out;
  set_iron(p, m);
  p.tau_cogging = m.tau_cogging;
  p.tau_cogging_3 = m.tau_cogging_3;
  p.cogging_per_turn = m.cogging_per_turn;
  p.cogging_phase = m.cogging_phase;
  const SinCos<double> phase = sincos(m.pole_cogging_phase);
  p.pole_cogging_cos = m.tau_pole_cogging * phase.cos;
  p.pole_cogging_sin = m.tau_pole_cogging * phase.sin;
  p.compliant = compliant ? 1.0 : 0.0;
  p.gear_stiffness = coupled ? m.gear_stiffness_out : 0.0;
  p.gear_damping = coupled ? m.gear_damping_out : 0.0;
  p.half_backlash = 0.5 * m.backlash_out;
  p.loss_driving = (1.0 / m.gear_efficiency - 1.0) / m.gear_ratio;
  p.loss_driven = (1.0 - m.gear_efficiency) / m.gear_ratio;
  p.tau_load = d.load.tau;
  p.tau_gravity = d.load.tau_gravity;
  p.theta_min = d.load.theta_min;
  p.theta_max = d.load.theta_max;
}

void set_supply_and_heat(PlantParams<double>& p, const DriveParams& d) {
  p.v_source = d.supply.v_source;
  p.R_source = d.supply.R_source;
  p.link_decay = exp_decay(-p.T_s / (d.supply.R_source * d.supply.C_link));
  p.link_rate = d.supply.C_link * p.f_s;
  p.inv_link_rate = 1.0 / p.link_rate;
  p.g_logic = d.supply.i_logic / 24.0;
  p.i_regen_max = d.supply.i_regen_max;
  p.heat_winding = p.T_s / d.thermal.C_winding;
  p.heat_housing = p.T_s / d.thermal.C_housing;
  p.heat_stage = p.T_s / d.thermal.C_stage;
  p.g_winding_housing = 1.0 / d.thermal.R_winding_housing;
  p.g_housing_ambient = 1.0 / d.thermal.R_housing_ambient;
  p.g_stage_ambient = 1.0 / d.thermal.R_stage_ambient;
  p.temp_ambient = d.thermal.temp_ambient;
}

void set_sensors(PlantParams<double>& p, const DriveParams& d) {
  p.counts_per_rad = static_cast<double>(1 << d.encoder.bits) / kTwoPi;
  p.encoder_direction = d.encoder.direction;
  p.encoder_offset = d.encoder.offset;
  const SinCos<double> phase_1 = sincos(d.encoder.inl_1_phase);
  const SinCos<double> phase_2 = sincos(d.encoder.inl_2_phase);
  p.inl_sin = d.encoder.inl_1 * phase_1.cos;
  p.inl_cos = d.encoder.inl_1 * phase_1.sin;
  p.inl_sin_2 = d.encoder.inl_2 * phase_2.cos;
  p.inl_cos_2 = d.encoder.inl_2 * phase_2.sin;
  p.encoder_noise = d.encoder.noise;
  p.encoder_latency = d.encoder.latency;
  // In voltage mode (MS series) there are no current sensors: the readings are zero.
  const double there = d.control.has_current_loop ? 1.0 : 0.0;
  p.gain_a = there * d.current_sensor.gain_a;
  p.gain_b = there * d.current_sensor.gain_b;
  p.offset_a = there * d.current_sensor.offset_a;
  p.offset_b = there * d.current_sensor.offset_b;
  p.current_noise = there * d.current_sensor.noise;
  p.current_lsb = 2.0 * d.current_sensor.range / static_cast<double>(1 << d.current_sensor.bits);
  p.inv_current_lsb = 1.0 / p.current_lsb;
  p.current_max = d.current_sensor.range;
}

}  // namespace

Inertia inertia_of(const MechanicsParams& m, double J_load, bool compliant, double f_s) {
  const double J_out = m.J_out + J_load;
  const double J_rotor = compliant ? m.J : m.J + J_out / (m.gear_ratio * m.gear_ratio);
  Inertia inertia{J_rotor * f_s, compliant ? J_out * f_s : 0.0, 0.0, 0.0};
  inertia.mobility = 1.0 / (inertia.rate + 0.5 * m.B);
  inertia.mobility_out = compliant && J_out > 0.0 ? 1.0 / inertia.rate_out : 0.0;
  return inertia;
}

void set_iron(PlantParams<double>& plant, const MechanicsParams& healthy) {
  plant.tau_hysteresis = healthy.hysteresis_share * healthy.tau_coulomb;
  plant.B_eddy = std::min(healthy.eddy_share * healthy.B, 2.0 * plant.B_half);
}

PlantParams<double> plant_params(const DriveParams& drive, bool coupled) {
  PlantParams<double> p;
  set_electrical(p, drive);
  set_mechanical(p, drive, coupled);
  set_supply_and_heat(p, drive);
  set_sensors(p, drive);
  return p;
}

}  // namespace lk::model
