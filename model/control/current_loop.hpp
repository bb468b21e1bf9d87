#pragma once

/// @file Field-oriented current control, once per PWM period (docs/internals/model.md §10), with
/// space-vector PWM by min–max injection (§9). Uses measurements, never the true state.

#include <tuple>

#include "model/measurement.hpp"
#include "model/rounding.hpp"
#include "model/transforms.hpp"

namespace lk::model {

inline namespace LKEMU_ISA {

/// Returns the duties 0..1 of the three legs. The common mode −(max + min)/2 centres them, as in
/// the symmetric space-vector sequence (Zhou & Wang 2002). Linear up to |v| = v_bus/√3. Rounds
/// duties to steps of the timer, then limits them to duty_min..duty_max.
template <class Real>
inline Abc<Real> svpwm(const AlphaBeta<Real>& v, const Real& inv_v_bus, const Real& timer_counts,
                       const Real& timer_lsb, const Real& duty_max) {
  const Abc<Real> x = inverse_clarke(v);
  const Real centre = 0.5 * (max(max(x.a, x.b), x.c) + min(min(x.a, x.b), x.c));
  const auto leg = [&](const Real& v_x) {
    const Real duty = 0.5 + (v_x - centre) * inv_v_bus;
    return clamp(nearest(duty * timer_counts) * timer_lsb, 1.0 - duty_max, duty_max);
  };
  return {leg(x.a), leg(x.b), leg(x.c)};
}

}  // namespace LKEMU_ISA

/// Gains and calibration of the current loop. They change when the host writes the current gains.
template <class T>
struct CurrentLoopParams {
  T closed{};                                        // 1: current loop; 0: voltage mode (MS series)
  T rad_e_per_count{}, rad_e_offset{};               // encoder counts → electrical angle
  T kp_d{}, kp_q{}, ki_T{}, unwind_d{}, unwind_q{};  // V/A, V/A per period, 1 per period
  T L_d{}, L_q{}, psi_f{};                           // nominal, for decoupling
  T advance_time{};  // s, 1.5·T_s: from a current sample to the middle of the resulting duties
  T modulation{};    // largest |v| as a fraction of v_bus
  T timer_counts{}, timer_lsb{}, duty_max{};
};

/// Inputs from the motion loops, constant between two runs of these loops.
template <class T>
struct CurrentOrders {
  T i_q_ref{};  // A
  T v_q_ref{};  // V, voltage mode only
  T omega_e{};  // rad/s, estimated
  T v_bus{24.0};
  T bridge_on{};  // 1 or 0
  T behind_e{};   // rad, electrical: in Lead, rotor angle minus angle of the dq frame; else 0
};

template <class T>
struct CurrentLoopState {
  T x_d{}, x_q{};                           // V, integrators
  T i_a{}, i_b{}, i_d{}, i_q{};             // A, measured
  T encoder_counts{};                       // counts, last measurement
  T v_d{}, v_q{};                           // V, requested, after limiting
  T duty_a{0.5}, duty_b{0.5}, duty_c{0.5};  // for the next period
  T bridge{};                               // 1 if the bridge is on in the next period
};

inline namespace LKEMU_ISA {

template <class P>
requires requires(P p) { p.rad_e_per_count; }
constexpr auto fields(P& p) {
  return std::tie(p.closed, p.rad_e_per_count, p.rad_e_offset, p.kp_d, p.kp_q, p.ki_T, p.unwind_d,
                  p.unwind_q, p.L_d, p.L_q, p.psi_f, p.advance_time, p.modulation, p.timer_counts,
                  p.timer_lsb, p.duty_max);
}
template <class O>
requires requires(O o) { o.i_q_ref; }
constexpr auto fields(O& o) {
  return std::tie(o.i_q_ref, o.v_q_ref, o.omega_e, o.v_bus, o.bridge_on, o.behind_e);
}
template <class S>
requires requires(S s) {
  s.duty_a;
  s.x_d;
}
constexpr auto fields(S& s) {
  return std::tie(s.x_d, s.x_q, s.i_a, s.i_b, s.i_d, s.i_q, s.encoder_counts, s.v_d, s.v_q,
                  s.duty_a, s.duty_b, s.duty_c, s.bridge);
}

/// Values derived from the orders, constant until the next orders.
template <class Real>
struct Held {
  Real v_max, v_d_max;             // V, limits of |v| and of |v_d|
  Real inv_v_bus;                  // 1/V
  SinCos<Real> advance;            // turn of the rotor until the duties act, ω_e·1.5·T_s
  Real omega_L_d, omega_L_q, emf;  // V/A, V/A, V: decoupling
};

/// Largest share of the voltage for the d axis (assumed). If the d axis used all, none would remain
/// for the q axis. The current of a motor reversed at full speed would get out of control.
inline constexpr double kFluxShare = 0.9;

template <class Real>
inline Held<Real> hold(const CurrentLoopParams<Real>& p, const CurrentOrders<Real>& orders) {
  const Real v_max = p.modulation * orders.v_bus;
  return {v_max,
          kFluxShare * v_max,
          1.0 / max(orders.v_bus, Real(1.0)),
          sincos<Real>(orders.omega_e * p.advance_time),
          orders.omega_e * p.L_d,
          orders.omega_e * p.L_q,
          orders.omega_e * p.psi_f};
}

/// PI controller: v = K_p·(i_ref − i) + x + decoupling, limited to the voltage circle. The d axis
/// has priority up to kFluxShare, so that a motor at the voltage limit turns as fast as its
/// back-EMF allows. Anti-windup by the limited voltage: x += K_i·T·e + unwind·(v_limited − v).
template <class Real>
inline Dq<Real> current_controller(const CurrentLoopParams<Real>& p,
                                   const CurrentOrders<Real>& orders, const Held<Real>& held,
                                   CurrentLoopState<Real>& s) {
  const Real e_d = -s.i_d;
  const Real e_q = orders.i_q_ref - s.i_q;
  const auto closed = p.closed != 0.0;
  const Real v_d = select(closed, (p.kp_d * e_d + s.x_d) - held.omega_L_q * s.i_q, Real(0.0));
  const Real v_q =
      select(closed, (p.kp_q * e_q + s.x_q) + (held.omega_L_d * s.i_d + held.emf), orders.v_q_ref);
  const Real v_d_given = clamp(v_d, -held.v_d_max, held.v_d_max);
  const Real room = sqrt(held.v_max * held.v_max - v_d_given * v_d_given);
  const Dq<Real> v{v_d_given, clamp(v_q, -room, room)};
  s.x_d += p.ki_T * e_d + p.unwind_d * (v.d - v_d);
  s.x_q += p.ki_T * e_q + p.unwind_q * (v.q - v_q);
  return v;
}

/// Computes the duties of the next period. Pre: without `may_be_off`, every bridge is on.
template <bool may_be_off = true, class Real>
inline void current_loop(const CurrentLoopParams<Real>& p, const CurrentOrders<Real>& orders,
                         const Held<Real>& held, const Measurement<Real>& m,
                         CurrentLoopState<Real>& s) {
  const SinCos<Real> theta_e =
      sincos<Real>(m.encoder_counts * p.rad_e_per_count - p.rad_e_offset - orders.behind_e);
  const Dq<Real> i = park(clarke(Abc<Real>{m.i_a, m.i_b, -m.i_a - m.i_b}), theta_e);
  s.i_a = m.i_a;
  s.i_b = m.i_b;
  s.i_d = i.d;
  s.i_q = i.q;
  s.encoder_counts = m.encoder_counts;

  const Dq<Real> v = current_controller(p, orders, held, s);
  const SinCos<Real> ahead = rotate(theta_e, held.advance);
  const Abc<Real> duty =
      svpwm(inverse_park(v, ahead), held.inv_v_bus, p.timer_counts, p.timer_lsb, p.duty_max);

  const auto integrates = p.ki_T != 0.0;  // not in voltage mode, nor with a gain of 0
  const Real half(0.5);
  const Real zero(0.0);
  const auto off = orders.bridge_on == 0.0;
  s.x_d = select_if<may_be_off>(off, zero, select(integrates, s.x_d, zero));
  s.x_q = select_if<may_be_off>(off, zero, select(integrates, s.x_q, zero));
  s.v_d = select_if<may_be_off>(off, zero, v.d);
  s.v_q = select_if<may_be_off>(off, zero, v.q);
  s.duty_a = select_if<may_be_off>(off, half, duty.a);
  s.duty_b = select_if<may_be_off>(off, half, duty.b);
  s.duty_c = select_if<may_be_off>(off, half, duty.c);
  s.bridge = orders.bridge_on;
}

}  // namespace LKEMU_ISA

}  // namespace lk::model
