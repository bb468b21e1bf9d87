#pragma once

/// @file The only mapping of motor file keys to model::DriveParams: key, member, SI value of the
/// key's unit, range in that unit. A new field needs one line here.

#include <numbers>

#include "emulator/config/config_reader.hpp"
#include "emulator/config/stator.hpp"
#include "emulator/core/bus_config.hpp"
#include "emulator/core/servo/registers.hpp"

namespace lk::emulator::profile_fields {

using enum Presence;
using std::numbers::pi;
inline constexpr double kDeg = pi / 180;
inline constexpr double kArcmin = kDeg / 60;
inline constexpr double kGramCm2 = 1e-7;
inline constexpr bool kMayLack = true;

// One row per line.
// clang-format off
using Ra = Rating;
inline const Field<Ra> kRating[] = {
    {"voltage_min_V", &Ra::voltage_min_V, 1, 0, 100},
    {"voltage_max_V", &Ra::voltage_max_V, 1, 0, 100},
    {"torque_rated_Nm", &Ra::torque_rated_Nm, 1, 0, 1e4},
    {"torque_peak_Nm", &Ra::torque_peak_Nm, 1, 0, 1e4},
    {"speed_rated_rpm", &Ra::speed_rated_rpm, 1, 0, 1e5},
    {"speed_no_load_rpm", &Ra::speed_no_load_rpm, 1, 0, 1e5},
    {"torque_constant_Nm_A", &Ra::torque_constant_Nm_A, 1, 0, 1e3},
};

using M = model::MotorParams;
inline const Field<M> kMotor[] = {
    {"pole_pairs", &M::pole_pairs, 1, 1, 64},
    {"R_s_ohm", &M::R_s, 1, 1e-3, 100},
    {"L_d_mH", &M::L_d, 1e-3, 1e-3, 100},
    {"L_q_mH", &M::L_q, 1e-3, 1e-3, 100},
    {"psi_f_Wb", &M::psi_f, 1, 1e-5, 1},
    {"alpha_cu_per_K", &M::alpha_cu, 1, 0, 0.01},
    {"alpha_pm_per_K", &M::alpha_pm, 1, -0.01, 0},
    {"torque_ripple", &M::torque_ripple, 1, 0, 0.1, kMayLack},
};

using I = model::InverterParams;
inline const Field<I> kInverter[] = {
    {"f_pwm_kHz", &I::f_pwm, 1e3, 4, 64},
    {"t_dead_ns", &I::t_dead, 1e-9, 0, 2000},
    {"R_on_mohm", &I::R_on, 1e-3, 0, 1000},
    {"v_diode_V", &I::v_diode, 1, 0, 2},
    {"timer_counts", &I::timer_counts, 1, 100, 100000},
    {"duty_max", &I::duty_max, 1, 0.5, 1},
    {"i_dead_zone_A", &I::i_dead_zone, 1, 1e-3, 10},
};

using Me = model::MechanicsParams;
inline const Field<Me> kMechanics[] = {
    {"J_g_cm2", &Me::J, kGramCm2, 0.1, 1e6},
    {"gear_ratio", &Me::gear_ratio, 1, 1, 1000},
    {"gear_efficiency", &Me::gear_efficiency, 1, 0.1, 1},
    {"backlash_arcmin", &Me::backlash_out, kArcmin, 0, 600},
    {"gear_stiffness_Nm_rad", &Me::gear_stiffness_out, 1, 0, 1e6},
    {"gear_damping_Nm_s_rad", &Me::gear_damping_out, 1, 0, 1e4},
    {"J_out_g_cm2", &Me::J_out, kGramCm2, 0, 1e7},
    {"tau_coulomb_out_mNm", &Me::tau_coulomb_out, 1e-3, 0, 1e5},
    {"tau_coulomb_mNm", &Me::tau_coulomb, 1e-3, 0, 1e4},
    {"tau_static_mNm", &Me::tau_static, 1e-3, 0, 1e4},
    {"omega_stribeck_rad_s", &Me::omega_stribeck, 1, 1e-3, 1e3},
    {"B_uNm_s_rad", &Me::B, 1e-6, 0, 1e6},
    {"tau_cogging_mNm", &Me::tau_cogging, 1e-3, 0, 1e3, kMayLack},
    {"tau_cogging_3_mNm", &Me::tau_cogging_3, 1e-3, 0, 1e3, kMayLack},
    {"cogging_per_turn", &Me::cogging_per_turn, 1, 1, 10000, kMayLack},
    {"tau_pole_cogging_mNm", &Me::tau_pole_cogging, 1e-3, 0, 1e3, kMayLack},
};

/// Gives the default of the rows that may lack in `mechanics`, `motor` and `current_sensor`.
inline const Field<Stator> kStator[] = {
    {"slots", &Stator::slots, 1, 3, 240},
    {"diameter_mm", &Stator::diameter, 1e-3, 5, 1000},
    {"height_mm", &Stator::height, 1e-3, 1, 1000},
};

/// Shares of the friction in kMechanics that heat the winding; the rest heats the housing.
inline const Field<Me> kIron[] = {
    {"hysteresis_share", &Me::hysteresis_share, 1, 0, 1},
    {"eddy_share", &Me::eddy_share, 1, 0, 1},
};

using L = model::LoadParams;
inline const Field<L> kLoad[] = {
    {"J_g_cm2", &L::J, kGramCm2, 0, 1e9},
    {"tau_Nm", &L::tau, 1, -1000, 1000},
    {"tau_gravity_Nm", &L::tau_gravity, 1, -1000, 1000},
    {"theta_min_deg", &L::theta_min, kDeg, -1e9, 1e9},
    {"theta_max_deg", &L::theta_max, kDeg, -1e9, 1e9},
};

using S = model::SupplyParams;
inline const Field<S> kSupply[] = {
    {"v_source_V", &S::v_source, 1, 0, 100},
    {"R_source_ohm", &S::R_source, 1, 0, 10},
    {"C_link_uF", &S::C_link, 1e-6, 1, 1e5},
    {"i_regen_max_A", &S::i_regen_max, 1, 0, 1000},
    {"i_logic_mA", &S::i_logic, 1e-3, 1, 2000},  // above 0, so that a drive without supply dies
};

using Lo = model::LogicParams;
inline const Field<Lo> kLogic[] = {
    {"reset_V", &Lo::v_reset, 1, 0, 60},
    {"reset_hysteresis_V", &Lo::v_reset_hysteresis, 1, 0, 10},
    {"boot_time_ms", &Lo::boot_time, 1e-3, 0, 60000},
};

using B = model::BrakeParams;
inline const Field<B> kBrake[] = {
    {"tau_mNm", &B::tau, 1e-3, 0, 1e5},
    {"engage_ms", &B::engage_time, 1e-3, 0, 10000},
    {"release_ms", &B::release_time, 1e-3, 0, 10000},
};

using T = model::ThermalParams;
inline const Field<T> kThermal[] = {
    {"R_winding_housing_K_W", &T::R_winding_housing, 1, 0.01, 1000},
    {"C_winding_J_K", &T::C_winding, 1, 0.1, 1e5},
    {"R_housing_ambient_K_W", &T::R_housing_ambient, 1, 0.01, 1000},
    {"C_housing_J_K", &T::C_housing, 1, 0.1, 1e6},
    {"R_stage_ambient_K_W", &T::R_stage_ambient, 1, 0.01, 1000},
    {"C_stage_J_K", &T::C_stage, 1, 0.1, 1e5},
    {"temp_ambient_C", &T::temp_ambient, 1, -40, 125},
};

using E = model::EncoderParams;
inline const Field<E> kEncoder[] = {
    {"bits", &E::bits, 1, 10, 18},
    {"direction", &E::direction, 1, -1, 1},
    {"offset_deg", &E::offset, kDeg, -360, 360},
    {"inl_1_deg", &E::inl_1, kDeg, 0, 10},
    {"inl_1_phase_deg", &E::inl_1_phase, kDeg, -360, 360},
    {"inl_2_deg", &E::inl_2, kDeg, 0, 10},
    {"inl_2_phase_deg", &E::inl_2_phase, kDeg, -360, 360},
    {"noise_deg", &E::noise, kDeg, 0, 5},
    {"latency_us", &E::latency, 1e-6, 0, 1000},
};

using C = model::CurrentSensorParams;
inline const Field<C> kCurrentSensor[] = {
    {"range_A", &C::range, 1, 0.1, 1000},
    {"bits", &C::bits, 1, 6, 24},
    {"gain_a", &C::gain_a, 1, 0.5, 1.5},
    {"gain_b", &C::gain_b, 1, 0.5, 1.5},
    {"offset_a_A", &C::offset_a, 1, -10, 10, kMayLack},
    {"offset_b_A", &C::offset_b, 1, -10, 10, kMayLack},
    {"noise_A", &C::noise, 1, 0, 10, kMayLack},
};

using Sl = model::SlowSensorParams;
inline const Field<Sl> kSlowSensor[] = {
    {"v_lsb_V", &Sl::v_lsb, 1, 1e-4, 1},
    {"v_noise_V", &Sl::v_noise, 1, 0, 5},
    {"temp_lsb_K", &Sl::temp_lsb, 1, 1e-3, 10},
};
/// Motor temperature sensor; by default it measures the winding only.
inline const Field<Sl> kThermistor[] = {
    {"board_share", &Sl::board_share, 1, 0, 1},
};

using Co = model::ControlParams;
inline const Field<Co> kControl[] = {
    {"motion_divider", &Co::motion_divider, 1, 1, 64},
    {"has_current_loop", &Co::has_current_loop},
    {"current_bandwidth_rad_s", &Co::current_bandwidth, 1, 1, 1e5},
    {"speed_bandwidth_rad_s", &Co::speed_bandwidth, 1, 0.1, 1e4},
    {"speed_integral_rate_per_s", &Co::speed_integral_rate, 1, 0, 1e4},
    {"angle_kp_per_byte_per_s", &Co::angle_kp_per_byte, 1, 0, 100},
    {"angle_ki_per_byte_per_s2", &Co::angle_ki_per_byte, 1, 0, 100},
    {"estimator_bandwidth_rad_s", &Co::estimator_bandwidth, 1, 1, 1e5},
    {"report_bandwidth_rad_s", &Co::report_bandwidth, 1, 1, 1e5},
    {"ref_current_byte", &Co::ref_current_byte, 1, 1, 255},
    {"ref_speed_kp_byte", &Co::ref_speed_kp_byte, 1, 1, 255},
    {"ref_speed_ki_byte", &Co::ref_speed_ki_byte, 1, 1, 255},
    {"J_nominal_g_cm2", &Co::J_nominal, kGramCm2, 0.1, 1e6},
    {"emf_share", &Co::emf_share, 1, 0, 1, kMayLack},
    {"report_delay_ms", &Co::report_delay, 1e-3, 0, 100, kMayLack},
};
// clang-format on

}  // namespace lk::emulator::profile_fields
