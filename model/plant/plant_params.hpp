#pragma once

/// @file Plant parameters in the form that the tick uses, derived from `DriveParams`. `T` holds the
/// value of one drive or of a block. Derive them again when load, supply or ambient change.

#include <tuple>

#include "model/drive_params.hpp"
#include "model/real.hpp"

namespace lk::model {

template <class T>
struct PlantParams {
  T T_s{}, f_s{};  // s, 1/s: one PWM period

  // Windings (docs/internals/model.md §3)
  T pole_pairs{}, R_25{}, alpha_cu{}, psi_25{}, alpha_pm{}, torque_ripple{}, L_d{}, L_q{};
  T T_by_L_d{}, T_by_L_q{}, L_d_by_L_q{}, L_q_by_L_d{};  // s/H, s/H, 1, 1

  // Inverter (§2): dead time as a fraction of the period; diode drop, mean over the period
  T dead_fraction{}, dead_drop{}, inv_i_dead_zone{}, R_on{}, v_diode{};

  // Mechanics (§4)
  T gear_ratio{}, inv_gear{};
  T inertia_rate{}, inertia_rate_out{};    // J/T_s of rotor (rigid: with the output), of output
  T B_half{}, mobility{}, mobility_out{};  // B/2; 1/(J/T_s + B/2); T_s/J_out, 0 when rigid
  T omega_max{};                           // rad/s: limit of the rotor's speed
  T tau_coulomb{}, tau_static_excess{}, inv_omega_stribeck2{}, tau_coulomb_out{};
  T tau_hysteresis{}, B_eddy{};  // friction that is lost in the stator's iron
  T tau_cogging{}, tau_cogging_3{}, cogging_per_turn{}, cogging_phase{};
  T pole_cogging_cos{}, pole_cogging_sin{};  // Nm: τ·cos φ, τ·sin φ at 2·pole_pairs per turn
  T compliant{};                             // 1: gear with stiffness and play, 0: rigid
  T gear_stiffness{}, gear_damping{}, half_backlash{}, loss_driving{}, loss_driven{};
  T tau_load{}, tau_gravity{}, theta_min{}, theta_max{};

  // Supply (§5)
  T v_source{}, R_source{}, link_decay{}, link_rate{}, inv_link_rate{}, i_regen_max{};
  T g_logic{};  // S, the drive's electronics

  // Heat (§6): T_s/C in K/J·s per node, conductances in W/K
  T heat_winding{}, heat_housing{}, heat_stage{}, g_winding_housing{}, g_housing_ambient{},
      g_stage_ambient{};
  T temp_ambient{};

  // Sensors (§7)
  T counts_per_rad{}, encoder_offset{}, encoder_noise{};
  T inl_sin{}, inl_cos{}, inl_sin_2{}, inl_cos_2{};  // rad, Fourier coefficients of the error
  T encoder_direction{}, encoder_latency{};
  T gain_a{}, gain_b{}, offset_a{}, offset_b{}, current_noise{}, current_lsb{}, inv_current_lsb{};
  T current_max{};
};

inline namespace LKEMU_ISA {

template <class Params>
requires requires(Params p) {
  p.T_by_L_q;
  p.current_max;
}
constexpr auto fields(Params& p) {
  return std::tie(
      p.T_s, p.f_s, p.pole_pairs, p.R_25, p.alpha_cu, p.psi_25, p.alpha_pm, p.torque_ripple, p.L_d,
      p.L_q, p.T_by_L_d, p.T_by_L_q, p.L_d_by_L_q, p.L_q_by_L_d, p.dead_fraction, p.dead_drop,
      p.inv_i_dead_zone, p.R_on, p.v_diode, p.gear_ratio, p.inv_gear, p.inertia_rate,
      p.inertia_rate_out, p.B_half, p.mobility, p.mobility_out, p.omega_max, p.tau_coulomb,
      p.tau_static_excess, p.inv_omega_stribeck2, p.tau_coulomb_out, p.tau_hysteresis, p.B_eddy,
      p.tau_cogging, p.tau_cogging_3, p.cogging_per_turn, p.cogging_phase, p.pole_cogging_cos,
      p.pole_cogging_sin, p.compliant, p.gear_stiffness, p.gear_damping, p.half_backlash,
      p.loss_driving, p.loss_driven, p.tau_load, p.tau_gravity, p.theta_min, p.theta_max,
      p.v_source, p.R_source, p.link_decay, p.link_rate, p.inv_link_rate, p.i_regen_max, p.g_logic,
      p.heat_winding, p.heat_housing, p.heat_stage, p.g_winding_housing, p.g_housing_ambient,
      p.g_stage_ambient, p.temp_ambient, p.counts_per_rad, p.encoder_offset, p.inl_sin, p.inl_cos,
      p.inl_sin_2, p.inl_cos_2, p.encoder_noise, p.encoder_direction, p.encoder_latency, p.gain_a,
      p.gain_b, p.offset_a, p.offset_b, p.current_noise, p.current_lsb, p.inv_current_lsb,
      p.current_max);
}

}  // namespace LKEMU_ISA

/// Derives the parameters of the tick. Pre: values are in the ranges stated in drive_params.hpp.
/// Without `coupled`, rotor and output are two bodies without a connection; an output without
/// inertia then stands still.
PlantParams<double> plant_params(const DriveParams& drive, bool coupled = true);

/// Inertia of rotor and output, in the form the tick uses.
struct Inertia {
  double rate, rate_out;          // Nm·s/rad per period
  double mobility, mobility_out;  // 1/(rate + B/2); 1/rate_out, 0 when rigid
};
/// `compliant`: rotor and output can move separately, by a compliant gear or a broken coupling.
Inertia inertia_of(const MechanicsParams& mechanics, double J_load, bool compliant, double f_s);

/// Sets the iron losses: shares of the friction of the `healthy` drive, without brake and faults.
/// plant_params() sets them as if its drive were healthy.
void set_iron(PlantParams<double>& plant, const MechanicsParams& healthy);

}  // namespace lk::model
