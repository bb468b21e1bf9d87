#pragma once

/// @file Two drives and their double pendulum as one system of equations in continuous time, solved
/// by SUNDIALS CVODE. Independent of model/plant/ and of the coupling.

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "model/drive_params.hpp"
#include "tests/emulator/coupling/hand_bodies.hpp"

namespace lk::test {

/// Both drives have equal parameters: a rigid gear, no dry friction, windings without temperature
/// effects.
class DoubleReference {
 public:
  // For each drive i_d, i_q, v_link; then both angles, both speeds.
  static constexpr std::size_t kSize = 10;
  using State = std::array<double, kSize>;

  // Each depends on the previous one. NOLINTBEGIN(cppcoreguidelines-prefer-member-initializer)
  DoubleReference(const model::DriveParams& drive, Equations body)
      : drive_(drive), body_(std::move(body)) {
    check(SUNContext_Create(nullptr, &context_));
    y_ = N_VNew_Serial(kSize, context_);
    const double v = drive.supply.v_source;
    const State start{0, 0, v, 0, 0, v, 0, 0, 0, 0};
    std::copy(start.begin(), start.end(), N_VGetArrayPointer(y_));
    matrix_ = SUNDenseMatrix(kSize, kSize, context_);
    linear_ = SUNLinSol_Dense(y_, matrix_, context_);
    solver_ = CVodeCreate(CV_ADAMS, context_);
    check(CVodeInit(solver_, slopes, 0.0, y_));
    check(CVodeSStolerances(solver_, 1e-9, 1e-10));
    check(CVodeSetUserData(solver_, this));
    check(CVodeSetLinearSolver(solver_, linear_, matrix_));
    check(CVodeSetMaxNumSteps(solver_, 100000));
  }
  // NOLINTEND(cppcoreguidelines-prefer-member-initializer)
  ~DoubleReference() {
    CVodeFree(&solver_);
    SUNLinSolFree(linear_);
    SUNMatDestroy(matrix_);
    N_VDestroy(y_);
    SUNContext_Free(&context_);
  }
  DoubleReference(const DoubleReference&) = delete;
  DoubleReference& operator=(const DoubleReference&) = delete;

  State state() const {
    State s{};
    std::copy_n(N_VGetArrayPointer(y_), s.size(), s.begin());
    return s;
  }
  /// Advances by `seconds` with constant duties of both drives' legs.
  void advance(const std::array<std::array<double, 3>, 2>& duty, double seconds) {
    duty_ = duty;
    check(CVodeReInit(solver_, time_, y_));  // restart, because the duties jump
    time_ += seconds;
    check(CVodeSetStopTime(solver_, time_));
    double reached = 0.0;
    check(CVode(solver_, time_, y_, &reached, CV_NORMAL));
  }

 private:
  static void check(int status) {
    if (status < 0) throw std::runtime_error("CVODE: " + std::to_string(status));
  }
  static int slopes(double /*t*/, N_Vector y, N_Vector dy, void* self) {
    static_cast<const DoubleReference*>(self)->slopes(N_VGetArrayPointer(y),
                                                      N_VGetArrayPointer(dy));
    return 0;
  }

  /// Computes the derivatives of one drive's currents and link; returns its torque on the joint.
  double electrical(std::size_t n, const double* y, double q, double w, double* dy) const {
    const model::DriveParams& p = drive_;
    const double N = p.mechanics.gear_ratio;
    const double i_d = y[0];
    const double i_q = y[1];
    const double dead = p.inverter.t_dead * p.inverter.f_pwm;
    double v_d = 0;
    double v_q = 0;
    double i_link = 0;
    for (int phase = 0; phase < 3; ++phase) {
      const double angle = p.motor.pole_pairs * N * q - phase * 2.0 * 3.14159265358979323846 / 3.0;
      const double i = i_d * std::cos(angle) - i_q * std::sin(angle);
      const double direction = std::clamp(i / p.inverter.i_dead_zone, -1.0, 1.0);
      const double duty = duty_[n][static_cast<std::size_t>(phase)] - dead * direction;
      const double v = y[2] * duty - 2.0 * dead * p.inverter.v_diode * direction;
      v_d += 2.0 / 3.0 * v * std::cos(angle);
      v_q -= 2.0 / 3.0 * v * std::sin(angle);
      i_link += duty * i;
    }
    const double omega_e = p.motor.pole_pairs * N * w;
    const double R = p.motor.R_s + p.inverter.R_on;
    dy[0] = (v_d - R * i_d + omega_e * p.motor.L_q * i_q) / p.motor.L_d;
    dy[1] = (v_q - R * i_q - omega_e * (p.motor.L_d * i_d + p.motor.psi_f)) / p.motor.L_q;
    dy[2] = ((p.supply.v_source - y[2]) / p.supply.R_source - i_link) / p.supply.C_link;
    const double tau_e =
        1.5 * p.motor.pole_pairs * (p.motor.psi_f + (p.motor.L_d - p.motor.L_q) * i_d) * i_q;
    return N * (tau_e - p.mechanics.B * N * w);
  }

  void slopes(const double* y, double* dy) const {
    const Two q{y[6], y[7]};
    const Two w{y[8], y[9]};
    const Dynamics d = body_(q, w);
    const model::MechanicsParams& m = drive_.mechanics;
    const double armature = m.gear_ratio * m.gear_ratio * m.J + m.J_out;
    const Two f{d.torque[0] + electrical(0, y, q[0], w[0], dy),
                d.torque[1] + electrical(1, y + 3, q[1], w[1], dy + 3)};
    const double M1 = d.diagonal[0] + armature;
    const double M2 = d.diagonal[1] + armature;
    const double det = M1 * M2 - d.coupling * d.coupling;
    dy[6] = w[0];
    dy[7] = w[1];
    dy[8] = (M2 * f[0] - d.coupling * f[1]) / det;
    dy[9] = (M1 * f[1] - d.coupling * f[0]) / det;
  }

  model::DriveParams drive_;
  Equations body_;
  std::array<std::array<double, 3>, 2> duty_{};
  double time_ = 0;
  SUNContext context_{};
  N_Vector y_{};
  SUNMatrix matrix_{};
  SUNLinearSolver linear_{};
  void* solver_{};
};

}  // namespace lk::test
