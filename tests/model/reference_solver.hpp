#pragma once

/// @file The plant's equations written independently in continuous time, solved by SUNDIALS CVODE.
///
/// Uses nothing of model/plant/: three phases with their angles, no dq formulas for the bridge.
/// Smooth effects only (no dry friction, no play), because the solver needs derivatives.

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

namespace lk::model::test {

/// i_d, i_q, θ, ω, v_link, winding, housing, stage.
using ReferenceState = std::array<double, 8>;

class ReferenceSolver {
 public:
  // Each depends on the previous one. NOLINTBEGIN(cppcoreguidelines-prefer-member-initializer)
  ReferenceSolver(const DriveParams& drive, const ReferenceState& start) : drive_(drive) {
    check(SUNContext_Create(nullptr, &context_));
    y_ = N_VNew_Serial(static_cast<sunindextype>(start.size()), context_);
    std::copy(start.begin(), start.end(), N_VGetArrayPointer(y_));
    matrix_ = SUNDenseMatrix(static_cast<sunindextype>(start.size()),
                             static_cast<sunindextype>(start.size()), context_);
    linear_ = SUNLinSol_Dense(y_, matrix_, context_);
    solver_ = CVodeCreate(CV_ADAMS, context_);
    check(CVodeInit(solver_, slopes, 0.0, y_));
    check(CVodeSStolerances(solver_, 1e-9, 1e-9));
    check(CVodeSetUserData(solver_, this));
    check(CVodeSetLinearSolver(solver_, linear_, matrix_));
    check(CVodeSetMaxNumSteps(solver_, 100000));
  }
  // NOLINTEND(cppcoreguidelines-prefer-member-initializer)
  ~ReferenceSolver() {
    CVodeFree(&solver_);
    SUNLinSolFree(linear_);
    SUNMatDestroy(matrix_);
    N_VDestroy(y_);
    SUNContext_Free(&context_);
  }
  ReferenceSolver(const ReferenceSolver&) = delete;
  ReferenceSolver& operator=(const ReferenceSolver&) = delete;

  ReferenceState state() const {
    ReferenceState s{};
    std::copy_n(N_VGetArrayPointer(y_), s.size(), s.begin());
    return s;
  }
  /// Advances by `seconds` with constant duties of the three legs.
  void advance(const std::array<double, 3>& duty, double seconds) {
    duty_ = duty;
    check(CVodeReInit(solver_, time_, y_));  // restart, because the duties jump
    time_ += seconds;
    check(CVodeSetStopTime(solver_, time_));
    double reached = 0.0;
    check(CVode(solver_, time_, y_, &reached, CV_NORMAL));
  }

 private:
  static void check(int status) {
    if (status < 0) {
      throw std::runtime_error("CVODE: " + std::to_string(status));
    }
  }

  static int slopes(double /*t*/, N_Vector y, N_Vector dy, void* self) {
    static_cast<const ReferenceSolver*>(self)->slopes(N_VGetArrayPointer(y),
                                                      N_VGetArrayPointer(dy));
    return 0;
  }

  void slopes(const double* y, double* dy) const {
    const DriveParams& p = drive_;
    const double i_d = y[0];
    const double i_q = y[1];
    const double theta = y[2];
    const double omega = y[3];
    const double v = y[4];
    const double omega_e = p.motor.pole_pairs * omega;
    const double R = p.motor.R_s * (1.0 + p.motor.alpha_cu * (y[5] - 25.0));
    const double psi = p.motor.psi_f * (1.0 + p.motor.alpha_pm * (y[5] - 25.0));

    // Each leg: its duty, shifted by dead time against the current; diode drop; projected on d and
    // q.
    const double dead = p.inverter.t_dead * p.inverter.f_pwm;
    double v_d = 0.0;
    double v_q = 0.0;
    double drop_d = 0.0;
    double drop_q = 0.0;
    double i_link = 0.0;
    for (int phase = 0; phase < 3; ++phase) {
      const double angle = p.motor.pole_pairs * theta - phase * 2.0 * 3.14159265358979323846 / 3.0;
      const double i = i_d * std::cos(angle) - i_q * std::sin(angle);
      const double direction = std::clamp(i / p.inverter.i_dead_zone, -1.0, 1.0);
      const double duty = duty_[static_cast<std::size_t>(phase)] - dead * direction;
      v_d += 2.0 / 3.0 * v * duty * std::cos(angle);
      v_q -= 2.0 / 3.0 * v * duty * std::sin(angle);
      const double drop = 2.0 * dead * p.inverter.v_diode * direction;
      drop_d += 2.0 / 3.0 * drop * std::cos(angle);
      drop_q -= 2.0 / 3.0 * drop * std::sin(angle);
      i_link += duty * i;
    }
    const double R_all = R + p.inverter.R_on;
    dy[0] = (v_d - drop_d - R_all * i_d + omega_e * p.motor.L_q * i_q) / p.motor.L_d;
    dy[1] = (v_q - drop_q - R_all * i_q - omega_e * (p.motor.L_d * i_d + psi)) / p.motor.L_q;

    const double tau_e = 1.5 * p.motor.pole_pairs * (psi + (p.motor.L_d - p.motor.L_q) * i_d) * i_q;
    const MechanicsParams& m = p.mechanics;
    const double J = m.J + (m.J_out + p.load.J) / (m.gear_ratio * m.gear_ratio);
    const double tau_out = p.load.tau - p.load.tau_gravity * std::sin(theta / m.gear_ratio);
    dy[2] = omega;
    dy[3] = (tau_e - m.B * omega - m.tau_cogging * std::sin(m.cogging_per_turn * theta) +
             tau_out / m.gear_ratio) /
            J;

    const double i_source =
        std::max((p.supply.v_source - v) / p.supply.R_source, -p.supply.i_regen_max);
    dy[4] = (i_source - i_link) / p.supply.C_link;

    const ThermalParams& h = p.thermal;
    const double square = i_d * i_d + i_q * i_q;
    const double to_housing = (y[5] - y[6]) / h.R_winding_housing;
    dy[5] = (1.5 * R * square - to_housing) / h.C_winding;
    dy[6] = (to_housing + m.B * omega * omega - (y[6] - h.temp_ambient) / h.R_housing_ambient) /
            h.C_housing;
    const double p_stage = 1.5 * (p.inverter.R_on * square + drop_d * i_d + drop_q * i_q);
    dy[7] = (p_stage - (y[7] - h.temp_ambient) / h.R_stage_ambient) / h.C_stage;
  }

  DriveParams drive_;
  std::array<double, 3> duty_{0.5, 0.5, 0.5};
  double time_ = 0.0;
  SUNContext context_{};
  N_Vector y_{};
  SUNMatrix matrix_{};
  SUNLinearSolver linear_{};
  void* solver_{};
};

}  // namespace lk::model::test
