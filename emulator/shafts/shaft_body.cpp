#include "emulator/shafts/shaft_body.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "emulator/core/coupling/coupling.hpp"

namespace lk::emulator {
namespace {

// More than any joint reaches, and far below the numeric limits of the model.
constexpr double kMostAngle_rad = 1e5;
constexpr double kMostSpeed_rad_s = 1e4;
constexpr double kMostInertia_kg_m2 = 1e6;
constexpr double kMostTorque_Nm = 1e6;
/// Minimum armature for a joint of unknown inertia: with less, nothing can be concluded.
constexpr double kLeastArmature_kg_m2 = 1e-9;
/// Relative rounding error allowed for the armature that a simulator adds.
constexpr double kRounding = 1e-6;

bool within(double value, double most) { return std::abs(value) <= most; }  // false for NaN

bool is_untold(const lk_shafts_accept& terms, const lk_shafts_state& state) {
  return terms.owner == LK_SHAFTS_SIMULATOR &&
         (state.inertia_kg_m2 == 0 || (terms.flags & LK_SHAFTS_TORQUE_UNTOLD) != 0);
}

/// Checks only numbers that are used.
std::string problem_of_numbers(const lk_shafts_state& state, const lk_shafts_accept& terms) {
  const bool moved_by_simulator = terms.owner == LK_SHAFTS_SIMULATOR;
  const auto is = [](const char* what, double value) {
    return fmt::format("{} is {}", what, value);
  };
  if (moved_by_simulator && !within(state.angle_rad, kMostAngle_rad)) {
    return is("angle_rad", state.angle_rad);
  }
  if (moved_by_simulator && !within(state.speed_rad_s, kMostSpeed_rad_s)) {
    return is("speed_rad_s", state.speed_rad_s);
  }
  if (!within(state.inertia_kg_m2, kMostInertia_kg_m2) || state.inertia_kg_m2 < 0) {
    return is("inertia_kg_m2", state.inertia_kg_m2);
  }
  if (!is_untold(terms, state) && !within(state.torque_Nm, kMostTorque_Nm)) {
    return is("torque_Nm", state.torque_Nm);
  }
  return "";
}

}  // namespace

bool is_one_shaft(const model::MechanicsParams& gear, SimTime step) {
  return is_stiff(gear, 0.0, step);
}

ShaftBody::ShaftBody(std::vector<ShaftJoint> joints, SimTime step) : step_(step) {
  for (ShaftJoint& joint : joints) {
    names_.push_back(std::move(joint.name));
    joints_.push_back({.terms = joint.terms,
                       .state = {joint.angle_rad, joint.speed_rad_s, 0, 0},
                       .armature_kg_m2 = joint.armature_kg_m2,
                       .told_armature_kg_m2 = joint.armature_kg_m2});
  }
}

/// Unknown inertia: uses the armature, as too small a value is stable (docs/shafts.md).
double ShaftBody::inertia_of(const Joint& joint) {
  const double told = joint.state.inertia_kg_m2;
  if (joint.terms.owner == LK_SHAFTS_DRIVE) return told + joint.armature_kg_m2;
  if (told == 0) return joint.armature_kg_m2;
  return told + joint.armature_kg_m2 - joint.told_armature_kg_m2;
}

JointView ShaftBody::joint(std::size_t joint) const {
  const Joint& it = joints_[joint];
  return {it.state.angle_rad, it.state.speed_rad_s, inertia_of(it), it.state.torque_Nm};
}

void ShaftBody::set_armature(std::size_t joint, double inertia_kg_m2) {
  joints_[joint].armature_kg_m2 = inertia_kg_m2;
}

void ShaftBody::advance(std::span<const JointTorque> torques) {
  ++steps_;
  for (std::size_t n = 0; n < joints_.size(); ++n) {
    Joint& joint = joints_[n];
    joint.torque_Nm += torques[n].mean_Nm;
    joint.slope_Nm_s = torques[n].slope_Nm_s;
    joint.state.angle_rad = torques[n].angle_rad;
    joint.state.speed_rad_s = torques[n].speed_rad_s;
  }
}

std::optional<std::string> ShaftBody::problem_of(std::span<const lk_shafts_state> states) const {
  for (std::size_t n = 0; n < joints_.size(); ++n) {
    const Joint& joint = joints_[n];
    const bool moved_by_simulator = joint.terms.owner == LK_SHAFTS_SIMULATOR;
    const double inertia = states[n].inertia_kg_m2;
    const double armature = joint.armature_kg_m2;
    std::string problem = problem_of_numbers(states[n], joint.terms);
    if (problem.empty() && moved_by_simulator && inertia == 0 && armature < kLeastArmature_kg_m2) {
      problem = "inertia_kg_m2 is 0, and has to be told where the drive brings no armature";
    }
    if (problem.empty() && moved_by_simulator && inertia > 0 &&
        inertia < armature * (1 - kRounding)) {
      problem = fmt::format(
          "inertia_kg_m2 is {}, less than the armature of {} that the joint has to have", inertia,
          armature);
    }
    if (!problem.empty()) return names_[n] + ": " + problem;
  }
  return std::nullopt;
}

double ShaftBody::found_torque_of(const Joint& joint, double speed_rad_s) const {
  if (!joint.told_speed_rad_s || steps_ == 0) return 0;
  const double steps = steps_;
  const double elapsed_s = steps * static_cast<double>(step_.count()) * 1e-9;
  const double acceleration = (speed_rad_s - *joint.told_speed_rad_s) / elapsed_s;
  return inertia_of(joint) * acceleration - joint.torque_Nm / steps;
}

void ShaftBody::take(std::span<const lk_shafts_state> states) {
  for (std::size_t n = 0; n < joints_.size(); ++n) {
    Joint& joint = joints_[n];
    const lk_shafts_state& told = states[n];
    joint.told_armature_kg_m2 = joint.armature_kg_m2;
    joint.state.inertia_kg_m2 = told.inertia_kg_m2;
    joint.state.torque_Nm = told.torque_Nm;
    if (joint.terms.owner == LK_SHAFTS_SIMULATOR) {
      if (is_untold(joint.terms, told))
        joint.state.torque_Nm = found_torque_of(joint, told.speed_rad_s);
      joint.state.angle_rad = told.angle_rad;
      joint.state.speed_rad_s = told.speed_rad_s;
      joint.told_speed_rad_s = told.speed_rad_s;
    }
    joint.torque_Nm = 0;
  }
  steps_ = 0;
}

std::vector<lk_shafts_torque> ShaftBody::torques() const {
  std::vector<lk_shafts_torque> all;
  for (const Joint& joint : joints_) {
    all.push_back({joint.torque_Nm / steps_, joint.slope_Nm_s, joint.armature_kg_m2,
                   joint.state.angle_rad, joint.state.speed_rad_s});
  }
  return all;
}

}  // namespace lk::emulator
