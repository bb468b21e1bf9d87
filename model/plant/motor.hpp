#pragma once

/// @file PMSM windings over one period, solved exactly (docs/internals/model.md §3).

#include "model/plant/inverter.hpp"
#include "model/plant/plant_params.hpp"
#include "model/transforms.hpp"

namespace lk::model {

/// Result of one period: currents at its end, and the means for torque, link and heat.
template <class Real>
struct WindingStep {
  Dq<Real> i_next, i_mean;
  Real mean_square, mean_dq;  // A², means of i_d² + i_q² and of i_d·i_q
  Real i_link;                // A drawn from the DC link, mean
  Real p_inverter;            // W lost in the semiconductors, mean
};

inline namespace LKEMU_ISA {

/// A current over the period as a parabola: mean, linear part, and quadratic part (both of mean 0).
template <class Real>
struct Course {
  Real mean, slope, bulge;
};

/// Returns the parabola with these values at both ends and this mean.
template <class Real>
inline Course<Real> course(const Real& begin, const Real& end, const Real& mean) {
  return {mean, end - begin, 6.0 * mean - 3.0 * (begin + end)};
}

/// Returns ∫₀¹ a·b ds. The functions 1, s − ½ and s(1 − s) − 1/6 are orthogonal; the integrals of
/// their squares are 1, 1/12 and 1/180.
template <class Real>
inline Real mean_product(const Course<Real>& a, const Course<Real>& b) {
  return a.mean * b.mean + a.slope * b.slope * (1.0 / 12) + a.bulge * b.bulge * (1.0 / 180);
}

/// L_d·di_d/dt = v_d − R·i_d + ω·L_q·i_q,  L_q·di_q/dt = v_q − R·i_q − ω·(L_d·i_d + ψ_f)
/// with v_dq, ω (electrical) constant over T: i(T) = i∞ + e^(A·T)·(i(0) − i∞), where for a 2×2
/// matrix
///   e^(A·T) = e^(μT)·(C·I + S·(A − μI)·T),  μ = tr A/2,  s = −det(A − μI)·T²,
///   C = cosh√s,  S = sinh√s/√s  as power series in s (they are entire; remainder s⁴/8! = 2e-7 at
///   the |s| = 0.3 of a motor at its fastest, 1e-12 at ordinary speeds).
/// Means follow from integrating the equations: i_mean = i∞ + (A·T)⁻¹·(i(T) − i(0)).
template <class Real>
inline WindingStep<Real> driven_windings(const PlantParams<Real>& p, const Dq<Real>& i0,
                                         const InverterOutput<Real>& bridge, const Real& v_link,
                                         const Real& R_s, const Real& psi_f, const Real& omega_e) {
  const Real R = R_s + p.R_on;
  const Real a_d = R * p.T_by_L_d;  // A·T = [−a_d  a_dq; −a_qd  −a_q]
  const Real a_q = R * p.T_by_L_q;
  const Real turn = omega_e * p.T_s;
  const Real a_dq = turn * p.L_q_by_L_d;
  const Real a_qd = turn * p.L_d_by_L_q;
  const Real coupling = turn * turn;  // a_dq·a_qd

  const Real u_d = (v_link * bridge.duty.d - bridge.v_drop.d) * p.T_by_L_d;
  const Real u_q = (v_link * bridge.duty.q - bridge.v_drop.q - omega_e * psi_f) * p.T_by_L_q;
  const Real inv_det = 1.0 / (a_d * a_q + coupling);
  // (A·T)⁻¹·x = −(a_q·x_d + a_dq·x_q, a_d·x_q − a_qd·x_d)/det
  const auto solve = [&](const Real& x_d, const Real& x_q) {
    return Dq<Real>{-(a_q * x_d + a_dq * x_q) * inv_det, (a_qd * x_d - a_d * x_q) * inv_det};
  };
  const Dq<Real> x_inf = solve(u_d, u_q);  // −i∞

  const Real half_difference = 0.5 * (a_d - a_q);
  const Real s = half_difference * half_difference - coupling;
  const Real s2 = s * s;
  const Real C = (1.0 + s * (1.0 / 2)) + s2 * (1.0 / 24 + s * (1.0 / 720));
  const Real S = (1.0 + s * (1.0 / 6)) + s2 * (1.0 / 120 + s * (1.0 / 5040));
  const Real decay = exp_small<Real>(-0.5 * (a_d + a_q));

  const Real delta_d = i0.d + x_inf.d;
  const Real delta_q = i0.q + x_inf.q;
  const Real e_d = decay * ((C - S * half_difference) * delta_d + S * a_dq * delta_q);
  const Real e_q = decay * ((C + S * half_difference) * delta_q - S * a_qd * delta_d);

  WindingStep<Real> step;
  step.i_next = {e_d - x_inf.d, e_q - x_inf.q};
  const Dq<Real> slope = solve(step.i_next.d - i0.d, step.i_next.q - i0.q);
  step.i_mean = {slope.d - x_inf.d, slope.q - x_inf.q};
  const Course<Real> course_d = course(i0.d, step.i_next.d, step.i_mean.d);
  const Course<Real> course_q = course(i0.q, step.i_next.q, step.i_mean.q);
  step.mean_square = mean_product(course_d, course_d) + mean_product(course_q, course_q);
  step.mean_dq = mean_product(course_d, course_q);
  step.i_link = 1.5 * (bridge.duty.d * step.i_mean.d + bridge.duty.q * step.i_mean.q);
  step.p_inverter = 1.5 * (p.R_on * step.mean_square + bridge.v_drop.d * step.i_mean.d +
                           bridge.v_drop.q * step.i_mean.q);
  return step;
}

/// Returns τ_e = 3/2·p·(ψ_f·i_q + (L_d − L_q)·i_d·i_q) [Nm], mean over the period.
template <class Real>
inline Real torque(const PlantParams<Real>& p, const WindingStep<Real>& step, const Real& psi_f) {
  return 1.5 * p.pole_pairs * (psi_f * step.i_mean.q + (p.L_d - p.L_q) * step.mean_dq);
}

}  // namespace LKEMU_ISA
}  // namespace lk::model
