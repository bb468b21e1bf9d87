#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "emulator/core/directive.hpp"
#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// State of a joint. For a short time the joint obeys inertia·acceleration = torque + body_torque,
/// where `torque` comes from the drive on the joint.
struct JointView {
  double angle_rad = 0;
  double speed_rad_s = 0;
  /// Effective inertia of all that moves with the joint, armature included.
  double inertia_kg_m2 = 0;
  /// Torque from gravity, contacts, and the other joints under their last torques.
  double body_torque_Nm = 0;
};

/// Torque on a joint over one step: mean + slope·(time from the middle of the step). Also angle and
/// speed of the joint at the end of the step, if the body responds as at the start.
struct JointTorque {
  double mean_Nm = 0;
  double slope_Nm_s = 0;
  double angle_rad = 0;
  double speed_rad_s = 0;
};

/// A body with joints that drives turn (docs/internals/decisions/0031-a-body-on-the-shafts.md). It
/// depends on its inputs only, and advances in equal steps. Joints without a drive turn freely.
class Mechanism {
 public:
  virtual ~Mechanism() = default;
  /// Returns an independent copy in the present state.
  virtual std::unique_ptr<Mechanism> clone() const = 0;

  /// Length of a step, above 0.
  virtual SimTime step() const = 0;
  /// Names of the joints that a drive can turn.
  virtual std::span<const std::string> joints() const = 0;
  /// State at the present instant. `joint` is an index in joints().
  virtual JointView joint(std::size_t joint) const = 0;
  /// Sets the inertia that a drive adds to a joint, kg·m² ≥ 0; 0 at first. After one or several
  /// calls, call `update` before anything else.
  virtual void set_armature(std::size_t joint, double inertia_kg_m2) = 0;
  /// Applies the armatures that were set.
  virtual void update() = 0;
  /// Advances one step with these torques, one for each of joints().
  virtual void advance(std::span<const JointTorque> torques) = 0;
  /// Names of the parts that can be pushed and loaded; "" marks a part that cannot.
  virtual std::span<const std::string> parts() const = 0;
  /// Sets force and torque on a part from now on, in world axes, at the part's centre of mass.
  virtual void push(std::size_t part, const std::array<double, 3>& force_N,
                    const std::array<double, 3>& torque_Nm) = 0;
  /// Sets the mass that the part carries at its centre of mass, kg ≥ 0. Call `update` next.
  virtual void carry(std::size_t part, double mass_kg) = 0;
  /// true: stops the body; no torque turns its joints. false: the body continues from rest. Call
  /// `update` next.
  virtual void freeze(bool on) = 0;
  /// End stops of a hinge joint, rad; nullopt: it turns freely.
  virtual std::optional<std::array<double, 2>> stops(std::size_t /*joint*/) const { return {}; }
  /// Names of the poses in the model; "" marks a pose without a name.
  virtual std::span<const std::string> keyframes() const { return {}; }
  /// Indices in parts() of the parts with a free joint.
  virtual std::span<const std::size_t> free_parts() const { return {}; }
  virtual bool has_floor() const { return false; }
  /// Pre: `has_floor()`. Changes the ground. Call `update` next.
  virtual void set_floor(const Floor& /*floor*/) {}
  /// Puts the body into a pose. Call `update` next.
  virtual void pose(const Pose& /*pose*/) {}
  /// Writes the present state to `state`.
  virtual void read_state(BodyState& /*state*/) const {}
  /// Why and where the state became invalid; nullopt while it is valid. An invalid body has
  /// stopped.
  virtual std::optional<std::string> failure() const = 0;

 protected:
  Mechanism() = default;
  Mechanism(const Mechanism&) = default;
  Mechanism(Mechanism&&) = default;
  Mechanism& operator=(const Mechanism&) = default;
  Mechanism& operator=(Mechanism&&) = default;
};

}  // namespace lk::emulator
