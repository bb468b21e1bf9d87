// Compares two complete drives on MuJoCo's double pendulum with a single system of equations.

#include <cvode/cvode.h>
#include <gtest/gtest.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <regex>
#include <stdexcept>
#include <string>
#include <vector>

#include "emulator/core/servo/registers.hpp"
#include "emulator/core/wire_timing.hpp"
#include "model/drive_params.hpp"
#include "tests/emulator/body/body_support.hpp"
#include "tests/emulator/coupling/coupling_support.hpp"
#include "tests/emulator/coupling/hand_bodies.hpp"
#include "tests/model/reference_firmware.hpp"
#include "tests/support/bus_config.hpp"

namespace lk::test {
namespace double_pendulum_test {

using emulator::Scenario;
using emulator::ScenarioRun;
using emulator::ServoConfig;

/// Two drives and their double pendulum as one system of equations in continuous time, solved by
/// SUNDIALS CVODE. Independent of model/plant/ and of the coupling. Both drives have equal
/// parameters: a rigid gear, no dry friction, windings without temperature
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

ServoConfig smooth_drive(int id) {
  ServoConfig servo = servo_config(id);
  model::DriveParams& d = servo.profile.drive;
  d.mechanics.gear_ratio = 6;
  d.mechanics.J = 2e-5;
  d.mechanics.J_out = 1e-4;
  d.mechanics.B = 1e-4;
  d.motor.alpha_cu = d.motor.alpha_pm = 0;
  d.encoder.bits = 18;
  servo.joint = emulator::JointLink{.joint = static_cast<std::size_t>(id - 1)};
  return servo;
}

protocol::Frame query(const protocol::Position5& step, int id) {
  const ServoConfig servo = smooth_drive(id);
  return protocol::encode_query(id, step,
                                protocol::wire_format(servo.quirks.dialect, servo.profile.series));
}

Scenario on_pendulum() {
  Scenario scenario = on_body(body_of(kDoublePendulum), {smooth_drive(1), smooth_drive(2)});
  scenario.robot.front().bitrate = 0;
  return scenario;
}

/// Requirement: 0.1 % of the travel.
TEST(DoublePendulum, MatchesOneSystemOfEquations) {
  ScenarioRun run(on_pendulum());
  const ServoConfig servo = smooth_drive(1);
  const model::DriveParams& d = servo.profile.drive;
  const auto settings = emulator::control_settings(
      servo.rom, protocol::wire_format(servo.quirks.dialect, servo.profile.series));
  std::array<model::test::Firmware, 2> firmware{model::test::Firmware(d, settings),
                                                model::test::Firmware(d, settings)};
  DoubleReference reference(d, double_pendulum(0.3, 0.25, 1e-5));
  const double T = 1 / d.inverter.f_pwm;
  const auto f_Hz = static_cast<std::int64_t>(d.inverter.f_pwm);
  double travel = 0;
  double worst = 0;
  std::int64_t tick = 0;
  for (const std::int32_t turn_cdeg : {30'000, -42'000, 18'000}) {  // of the rotors
    const auto now = emulator::time_of_tick(tick, f_Hz);
    for (const int id : {1, 2}) {
      run.receive(0, {now, query({id == 1 ? turn_cdeg : -turn_cdeg / 2}, id)});
      run.advance_to(now);
      firmware[static_cast<std::size_t>(id - 1)].command(run.bus(0).state().setpoint(id));
    }
    for (const std::int64_t end = tick + f_Hz / 4; tick < end; ++tick) {
      const DoubleReference::State y = reference.state();
      std::array<std::array<double, 3>, 2> duty{};
      for (std::size_t n = 0; n < 2; ++n) {
        const double N = d.mechanics.gear_ratio;
        duty[n] = firmware[n].step(
            {y[3 * n], y[3 * n + 1], N * y[6 + n], N * y[8 + n], y[3 * n + 2], 25, 25, 25});
      }
      reference.advance(duty, T);
      if ((tick + 1) % (f_Hz / 1000) != 0) continue;
      run.advance_to(emulator::time_of_tick(tick + 1, f_Hz));
      for (std::size_t n = 0; n < 2; ++n) {
        const double angle = run.body()->joint(n).angle_rad;
        travel = std::max(travel, std::abs(angle));
        worst = std::max(worst, std::abs(angle - reference.state()[6 + n]));
      }
    }
  }
  EXPECT_GT(travel, 0.8);
  EXPECT_LT(worst, 1e-3 * travel);
}

/// Errors of both joints after 0.4 s under constant torques in steps of 1, 2 and 4 ms, relative to
/// steps of 1/8 ms. Without quantisation: PWM, encoder and current sensor are as fine as possible.
std::array<double, 3> errors_with(const std::string& integrator) {
  const std::string model = std::regex_replace(
      std::string(kDoublePendulum), std::regex(R"(timestep="0.001" integrator="RK4")"),
      R"(timestep="0.004" integrator=")" + integrator + '"');
  const auto angles_after = [&](emulator::SimTime step) {
    std::vector<ServoConfig> drives = {smooth_drive(1), smooth_drive(2)};
    for (ServoConfig& servo : drives) {
      servo.profile.drive.inverter.timer_counts = 1e9;
      servo.profile.drive.current_sensor.bits = 26;
    }
    Scenario scenario = on_body(body_of(model, step), drives);
    scenario.robot.front().bitrate = 0;
    const auto format = protocol::wire_format(drives[0].quirks.dialect, drives[0].profile.series);
    for (const int id : {1, 2}) {
      scenario.sends.push_back(
          {.frame = protocol::encode_query(id, protocol::Torque{id == 1 ? 1.5 : -1.0}, format)});
    }
    ScenarioRun run(scenario);
    run.advance_to(400 * kMs);
    return Two{run.body()->joint(0).angle_rad, run.body()->joint(1).angle_rad};
  };
  const Two exact = angles_after(kMs / 8);
  std::array<double, 3> errors{};
  for (std::size_t n = 0; n < errors.size(); ++n) {
    const Two angles = angles_after(kMs * (1 << n));
    errors[n] = std::max(std::abs(angles[0] - exact[0]), std::abs(angles[1] - exact[1]));
  }
  return errors;
}

/// Doubling the step multiplies the error by four, minus higher orders and the reference's own
/// error.
TEST(DoublePendulum, ConvergesWithSecondOrderUnderRungeKutta) {
  const auto error = errors_with("RK4");
  for (const std::size_t n : {1U, 2U}) EXPECT_GT(error[n] / error[n - 1], 3.0) << n;
}

/// Doubling the step doubles the error.
TEST(DoublePendulum, ConvergesWithFirstOrderUnderEuler) {
  const auto error = errors_with("Euler");
  for (const std::size_t n : {1U, 2U}) EXPECT_NEAR(error[n] / error[n - 1], 2.2, 0.4) << n;
}

TEST(DoublePendulum, RepeatsAlsoInSlices) {
  const auto end = [](std::chrono::microseconds slice) {
    ScenarioRun run(on_pendulum());
    run.receive(0, {kMs, query({30'000}, 1)});
    for (auto t = slice; t < 300 * kMs; t += slice) run.advance_to(t);
    run.advance_to(300 * kMs);
    return std::array{run.body()->joint(0).angle_rad, run.body()->joint(1).angle_rad,
                      run.bus(0).truth(1).i_q, run.bus(0).truth(2).theta_m};
  };
  const auto first = end(std::chrono::microseconds(300'000));
  EXPECT_EQ(end(std::chrono::microseconds(300'000)), first);
  EXPECT_EQ(end(std::chrono::microseconds(300'000)), first);
  EXPECT_EQ(end(std::chrono::microseconds(713)), first);
}

}  // namespace double_pendulum_test
}  // namespace lk::test
