#pragma once

/// @file Bodies written by hand, for tests of the coupling between drives and bodies.

#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "emulator/core/coupling/mechanism.hpp"

namespace lk::test {

/// Values of one or two joints.
using Two = std::array<double, 2>;

struct Dynamics {
  Two diagonal;      // of the mass matrix
  double coupling;   // its off-diagonal element
  Two torque;        // gravity and velocity terms
  double potential;  // J
};
/// Equations of a body at angles and speeds, without armature.
using Equations = std::function<Dynamics(const Two& q, const Two& v)>;

/// M(q)·a = torque(q, v) + drive torques; RK4, with torques that change linearly within a step.
class HandBody : public emulator::Mechanism {
 public:
  HandBody(std::size_t joints, Equations equations, emulator::SimTime step, Two q0 = {},
           Two v0 = {})
      : equations_(std::move(equations)), step_(step), q_(q0), v_(v0) {
    for (std::size_t n = 0; n < joints; ++n) names_.push_back("joint_" + std::to_string(n));
    update();
  }
  std::unique_ptr<Mechanism> clone() const override { return std::make_unique<HandBody>(*this); }
  emulator::SimTime step() const override { return step_; }
  std::span<const std::string> joints() const override { return names_; }
  emulator::JointView joint(std::size_t n) const override {
    const Dynamics d = with_armature(q_, v_);
    const double other = d.diagonal[1 - n];
    const double inertia = d.diagonal[n] - (other > 0 ? d.coupling * d.coupling / other : 0.0);
    return {q_[n], v_[n], inertia, inertia * acceleration(q_, v_, before_)[n] - before_[n]};
  }
  void set_armature(std::size_t n, double inertia) override { armature_[n] = inertia; }
  void update() override {}
  void advance(std::span<const emulator::JointTorque> torques) override {
    const double h = std::chrono::duration<double>(step_).count();
    const auto at = [&](double s) {
      Two all{};
      for (std::size_t n = 0; n < torques.size(); ++n) {
        all[n] = torques[n].mean_Nm + torques[n].slope_Nm_s * (s - 0.5 * h);
      }
      return all;
    };
    const auto plus = [](const Two& x, double s, const Two& y) {
      return Two{x[0] + s * y[0], x[1] + s * y[1]};
    };
    const Two a1 = acceleration(q_, v_, at(0));
    const Two v2 = plus(v_, 0.5 * h, a1);
    const Two a2 = acceleration(plus(q_, 0.5 * h, v_), v2, at(0.5 * h));
    const Two v3 = plus(v_, 0.5 * h, a2);
    const Two a3 = acceleration(plus(q_, 0.5 * h, v2), v3, at(0.5 * h));
    const Two v4 = plus(v_, h, a3);
    const Two a4 = acceleration(plus(q_, h, v3), v4, at(h));
    const Two q_before = q_;
    for (std::size_t n = 0; n < 2; ++n) {
      q_[n] += h / 6 * (v_[n] + 2 * v2[n] + 2 * v3[n] + v4[n]);
      v_[n] += h / 6 * (a1[n] + 2 * a2[n] + 2 * a3[n] + a4[n]);
    }
    for (std::size_t n = 0; n < torques.size(); ++n) {
      before_[n] = torques[n].mean_Nm;
      taken_J_ += torques[n].mean_Nm * (q_[n] - q_before[n]);
    }
  }
  std::span<const std::string> parts() const override { return {}; }
  void push(std::size_t, const std::array<double, 3>&, const std::array<double, 3>&) override {}
  void carry(std::size_t, double) override {}
  void freeze(bool) override {}
  void pose(const emulator::Pose& pose) override {
    for (const auto& [joint, angle_rad] : pose.joints) q_[joint] = angle_rad;
    v_ = before_ = {};
  }
  std::optional<std::string> failure() const override { return std::nullopt; }

  const Two& angles() const { return q_; }
  const Two& speeds() const { return v_; }
  /// Kinetic and potential energy, including that of the armature.
  double energy_J() const {
    const Dynamics d = with_armature(q_, v_);
    return 0.5 * (d.diagonal[0] * v_[0] * v_[0] + d.diagonal[1] * v_[1] * v_[1]) +
           d.coupling * v_[0] * v_[1] + d.potential;
  }
  double taken_J() const { return taken_J_; }

 private:
  Dynamics with_armature(const Two& q, const Two& v) const {
    Dynamics d = equations_(q, v);
    for (std::size_t n = 0; n < 2; ++n) d.diagonal[n] += armature_[n];
    return d;
  }
  Two acceleration(const Two& q, const Two& v, const Two& given) const {
    const Dynamics d = with_armature(q, v);
    const Two f = {d.torque[0] + given[0], d.torque[1] + given[1]};
    if (names_.size() == 1) return {f[0] / d.diagonal[0], 0};
    const double det = d.diagonal[0] * d.diagonal[1] - d.coupling * d.coupling;
    return {(d.diagonal[1] * f[0] - d.coupling * f[1]) / det,
            (d.diagonal[0] * f[1] - d.coupling * f[0]) / det};
  }

  Equations equations_;
  emulator::SimTime step_;
  std::vector<std::string> names_;
  Two q_, v_;
  Two armature_{};
  Two before_{};
  double taken_J_ = 0;
};

inline Equations linear_inertia(double J, double tau = 0) {
  return [=](const Two& q, const Two&) { return Dynamics{{J, 0}, 0, {tau, 0}, -tau * q[0]}; };
}

inline Equations pendulum(double J, double mgl) {
  return [=](const Two& q, const Two&) {
    return Dynamics{{J, 0}, 0, {-mgl * std::sin(q[0]), 0}, -mgl * std::cos(q[0])};
  };
}

/// Two equal massless rods, each with a mass of inertia `I` at its end; the second angle is
/// relative to the first rod. 0: hanging.
inline Equations double_pendulum(double m, double l, double I = 0) {
  return [=](const Two& q, const Two& v) {
    const double g = 9.81;
    const double ml2 = m * l * l;
    const double c = std::cos(q[1]);
    const double s = std::sin(q[1]);
    const double g1 = m * g * l * std::sin(q[0]);
    const double g2 = m * g * l * std::sin(q[0] + q[1]);
    return Dynamics{
        {ml2 * (3 + 2 * c) + 2 * I, ml2 + I},
        ml2 * (1 + c) + I,
        {ml2 * s * (2 * v[0] * v[1] + v[1] * v[1]) - 2 * g1 - g2, -ml2 * s * v[0] * v[0] - g2},
        -m * g * l * (2 * std::cos(q[0]) + std::cos(q[0] + q[1]))};
  };
}

}  // namespace lk::test
