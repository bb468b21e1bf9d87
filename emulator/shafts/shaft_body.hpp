#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "emulator/core/coupling/mechanism.hpp"
#include "emulator/shafts/lk_shafts.h"

namespace lk::emulator {

/// Whether a simulator has rotor and output of a gear as one, as of a stiff one (Coupling). What is
/// behind the spring may be nothing, and may not be told: a spring that a bare output follows
/// within a step is left to the drive.
bool is_one_shaft(const model::MechanicsParams& gear, SimTime step);

/// A joint that a simulator has taken.
struct ShaftJoint {
  std::string name;  // "vcan0:1"
  lk_shafts_accept terms{};
  // Of the drive's output shaft, now.
  double angle_rad = 0;
  double speed_rad_s = 0;
  double armature_kg_m2 = 0;
};

/// The joints as a simulator tells of them (docs/shafts.md): a body whose steps are computed
/// elsewhere. What it was given last waits in `torques` until `take` brings what came of it.
class ShaftBody final : public Mechanism {
 public:
  ShaftBody(std::vector<ShaftJoint> joints, SimTime step);

  std::unique_ptr<Mechanism> clone() const override { return std::make_unique<ShaftBody>(*this); }
  SimTime step() const override { return step_; }
  std::span<const std::string> joints() const override { return names_; }
  JointView joint(std::size_t joint) const override;
  void set_armature(std::size_t joint, double inertia_kg_m2) override;
  void update() override {}
  /// Where the drives leave their joints is where these are until the simulator says otherwise.
  void advance(std::span<const JointTorque> torques) override;
  /// What else the simulator has is its own: nothing that could be pushed from here.
  std::span<const std::string> parts() const override { return {}; }
  void push(std::size_t, const std::array<double, 3>&, const std::array<double, 3>&) override {}
  void carry(std::size_t, double) override {}
  void freeze(bool) override {}
  std::optional<std::string> failure() const override { return std::nullopt; }

  /// What is wrong with these states of its joints; nothing when they can be taken.
  std::optional<std::string> problem_of(std::span<const lk_shafts_state> states) const;
  /// The simulator's answer to `torques`, or, before the first step, where it begins.
  void take(std::span<const lk_shafts_state> states);
  /// Means over the steps since the last `take`, and how many these were.
  std::vector<lk_shafts_torque> torques() const;
  unsigned steps() const { return steps_; }

 private:
  struct Joint {
    lk_shafts_accept terms;
    lk_shafts_state state;                                  // as of now
    double armature_kg_m2;                                  // as of now
    double told_armature_kg_m2;                             // that is in the state's inertia
    std::optional<double> told_speed_rad_s = std::nullopt;  // by the last `take`
    double torque_Nm = 0;                                   // sum of the means since then
    double slope_Nm_s = 0;                                  // of the last step
  };
  static double inertia_of(const Joint& joint);
  /// What acts on a joint beside its drive, by how it has moved since the last `take`.
  double found_torque_of(const Joint& joint, double speed_rad_s) const;

  SimTime step_;
  std::vector<std::string> names_;
  std::vector<Joint> joints_;
  unsigned steps_ = 0;
};

}  // namespace lk::emulator
