#pragma once

/// @file Advances the hardware of a drive by one PWM period (docs/internals/model.md §1): bridge →
/// windings → mechanics → link and heat. The firmware is in control/.

#include <tuple>

#include "model/plant/inverter.hpp"
#include "model/plant/lane_faults.hpp"
#include "model/plant/leg_bridge.hpp"
#include "model/plant/mechanics.hpp"
#include "model/plant/motor.hpp"
#include "model/plant/supply.hpp"
#include "model/plant/thermal.hpp"
#include "model/stored_real.hpp"

namespace lk::model {

template <class T>
struct PlantState {
  T i_d{}, i_q{};                                  // A
  T theta{}, omega{}, theta_out{}, omega_out{};    // rad, rad/s
  T omega_change{};                                // rad/s, over the last period
  T v_link{}, i_link{};                            // V, A
  T temp_winding{}, temp_housing{}, temp_stage{};  // °C
  T tau_e{};                                       // Nm, mean of the last period
  // Energy ledger since the start: sums of the mean powers of all periods, W. The energy in J is
  // the sum times T_s (docs/internals/model.md §8).
  T p_supply{}, p_copper{}, p_inverter{}, p_friction{}, p_gear{}, p_load{};
};

inline namespace LKEMU_ISA {

template <class State>
requires requires(State s) { s.p_supply; }
constexpr auto fields(State& s) {
  return std::tie(s.i_d, s.i_q, s.theta, s.omega, s.theta_out, s.omega_out, s.omega_change,
                  s.v_link, s.i_link, s.temp_winding, s.temp_housing, s.temp_stage, s.tau_e,
                  s.p_supply, s.p_copper, s.p_inverter, s.p_friction, s.p_gear, s.p_load);
}

/// Returns the input of the leg solver for drive `n` at the start of a period.
template <class Real>
inline LegBridgeInput leg_bridge_input(const PlantParams<Real>& p, const PlantState<Real>& s,
                                       const Real& v_link, const Real& R_s, const Real& psi_f,
                                       const Real& omega_e, std::size_t n) {
  return {{get_lane(s.i_d, n), get_lane(s.i_q, n)},
          get_lane(p.pole_pairs, n) * get_lane(s.theta, n),
          get_lane(omega_e, n),
          get_lane(v_link, n),
          1.0 / get_lane(p.inv_i_dead_zone, n),
          get_lane(R_s, n),
          get_lane(p.L_d, n),
          get_lane(p.L_q, n),
          get_lane(psi_f, n),
          get_lane(p.T_s, n),
          0.0};
}

template <class Real>
inline void set_step(WindingStep<Real>& step, std::size_t n, const WindingStep<double>& one) {
  set_lane(step.i_next.d, n, one.i_next.d);
  set_lane(step.i_next.q, n, one.i_next.q);
  set_lane(step.i_mean.d, n, one.i_mean.d);
  set_lane(step.i_mean.q, n, one.i_mean.q);
  set_lane(step.mean_square, n, one.mean_square);
  set_lane(step.mean_dq, n, one.mean_dq);
  set_lane(step.i_link, n, one.i_link);
  set_lane(step.p_inverter, n, one.p_inverter);
}

/// Computes the windings of drives whose bridge is off and whose diodes conduct. Handles one drive
/// at a time, because the case is rare and has many branches. Writes the lanes of `mask` only.
template <class Real, class Mask>
inline void freewheel(const PlantParams<Real>& p, const PlantState<Real>& s, const Real& v_link,
                      const Real& R_s, const Real& psi_f, const Real& omega_e, const Mask& mask,
                      WindingStep<Real>& step) {
  for (std::size_t n = 0; n < kSizeOf<Real>; ++n) {
    if (lane_set(mask, n)) {
      set_step(step, n,
               leg_bridge(leg_bridge_input(p, s, v_link, R_s, psi_f, omega_e, n),
                          open_switches(get_lane(p.v_diode, n)))
                   .step);
    }
  }
}

/// Computes the windings of drives with a broken leg, one drive at a time. `i_short` is the part of
/// the link's current that flows through a leg from rail to rail.
template <class Real>
inline void broken_bridge(const LaneFaults* faults, const PlantParams<Real>& p,
                          const PlantState<Real>& s, const Real& v_link, const Real& R_s,
                          const Real& psi_f, const Real& omega_e, const Abc<Real>& duty,
                          const Real& bridge_on, WindingStep<Real>& step, Real& i_short) {
  const Real emptying = emptying_current(p, s.v_link);
  for (std::size_t n = 0; n < kSizeOf<Real>; ++n) {
    if (!faults[n].leg_broken()) {
      continue;
    }
    const LegParts parts{get_lane(p.v_diode, n), get_lane(p.R_on, n), get_lane(p.dead_fraction, n),
                         get_lane(p.dead_drop, n)};
    const BrokenBridge bridge{faults[n].legs,
                              {get_lane(duty.a, n), get_lane(duty.b, n), get_lane(duty.c, n)},
                              get_lane(bridge_on, n) != 0.0,
                              get_lane(s.v_link, n),
                              get_lane(p.link_rate, n),
                              get_lane(emptying, n)};
    const BrokenBridgeStep one = broken_bridge_step(
        leg_bridge_input(p, s, max(v_link, Real(0.0)), R_s, psi_f, omega_e, n), parts, bridge);
    set_step(step, n, one.step);
    set_lane(i_short, n, one.i_short);
  }
}

template <class Real, class Mask>
inline void clear_where(const Mask& mask, WindingStep<Real>& step) {
  const Real zero(0.0);
  for (Real* x : {&step.i_next.d, &step.i_next.q, &step.i_mean.d, &step.i_mean.q, &step.mean_square,
                  &step.mean_dq, &step.i_link, &step.p_inverter}) {
    *x = select(mask, zero, *x);
  }
}

/// Advances the plant by T_s under constant duties. Current `i_abc` and angle `theta_e` (sin, cos)
/// are those at the start of the period. Without `parts.faults`, does not read `faults`.
template <Parts parts = kEveryPart, class Real>
inline void advance(const PlantParams<Real>& p, PlantState<Real>& s, const Abc<Real>& duty,
                    const Real& bridge_on, const Abc<Real>& i_abc, const SinCos<Real>& theta_e,
                    [[maybe_unused]] const LaneFaults* faults = nullptr) {
  // Speed and link voltage half a period ahead make the step second order without an iteration.
  const Real omega_middle = s.omega + 0.5 * s.omega_change;
  const Real omega_e = p.pole_pairs * omega_middle;
  const Real v_middle = 0.5 * (s.v_link + link(p, s.v_link, s.i_link).v_next);

  const Real R_s = p.R_25 * (1.0 + p.alpha_cu * (s.temp_winding - 25.0));
  // Far above a magnet's temperature limit, the flux is zero: the formula must not change its sign.
  const Real psi_mean = max(p.psi_25 * (1.0 + p.alpha_pm * (s.temp_winding - 25.0)), Real(0.0));

  const SinCos<Real> middle = rotate(theta_e, sincos_small<Real>(0.5 * p.T_s * omega_e));
  const SinCos<Real> pole = per_pole(middle);
  // cos 3x = x·(4x² − 3): the 5th and 7th harmonics of the back-EMF, seen from the rotor.
  const Real ripple = pole.cos * (4.0 * (pole.cos * pole.cos) - 3.0);
  const Real psi_f = psi_mean * (1.0 + p.torque_ripple * ripple);
  const InverterOutput<Real> bridge = inverter(p, duty, i_abc, middle);
  WindingStep<Real> step =
      driven_windings(p, {s.i_d, s.i_q}, bridge, v_middle, R_s, psi_f, omega_e);

  if constexpr (parts.bridge_off) {
    const auto off = bridge_on == 0.0;
    clear_where(off, step);
    const auto conducts = off && (s.i_d != 0.0 || s.i_q != 0.0 ||
                                  kSqrt3 * psi_f * abs(omega_e) > v_middle + 2.0 * p.v_diode);
    if (any(conducts)) {
      freewheel(p, s, v_middle, R_s, psi_f, omega_e, conducts, step);
    }
  }
  [[maybe_unused]] Real i_short(0.0);
  if constexpr (parts.faults) {
    broken_bridge(faults, p, s, v_middle, R_s, psi_f, omega_e, duty, bridge_on, step, i_short);
  }

  const Real tau_e = torque(p, step, psi_f);
  const MechanicsStep<Real> mech =
      mechanics<parts>(p, {s.theta, s.omega, s.theta_out, s.omega_out}, tau_e, pole);
  const Real i_logic = p.g_logic * s.v_link;
  const Real i_link = step.i_link + i_logic;
  const LinkStep<Real> dc = link(p, s.v_link, i_link);
  const Real v_mean = 0.5 * (s.v_link + dc.v_next);
  const Real p_copper = 1.5 * R_s * step.mean_square;
  if constexpr (parts.faults) {
    step.p_inverter += v_mean * i_short;
  }
  const Real p_board = step.p_inverter + v_mean * i_logic;
  const Temperatures<Real> heat =
      thermal<Real>(p, {s.temp_winding, s.temp_housing, s.temp_stage},
                    {p_copper + mech.p_iron, mech.p_friction - mech.p_iron + mech.p_gear, p_board});

  s.p_supply += v_mean * dc.i_source;
  s.p_copper += p_copper;
  s.p_inverter += p_board;
  s.p_friction += mech.p_friction;
  s.p_gear += mech.p_gear;
  s.p_load += mech.p_load;

  s.i_d = step.i_next.d;
  s.i_q = step.i_next.q;
  s.omega_change = mech.next.omega - s.omega;
  s.theta = mech.next.theta;
  s.omega = mech.next.omega;
  s.theta_out = mech.next.theta_out;
  s.omega_out = mech.next.omega_out;
  s.tau_e = tau_e;
  s.v_link = dc.v_next;
  s.i_link = i_link;
  s.temp_winding = heat.winding;
  s.temp_housing = heat.housing;
  s.temp_stage = heat.stage;
}

}  // namespace LKEMU_ISA
}  // namespace lk::model
