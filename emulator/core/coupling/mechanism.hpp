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

/// A joint of a body at an instant, and what a shaft on it feels for a short while from then on:
/// inertia·acceleration = torque + body_torque, where `torque` is what its drive gives.
struct JointView {
  double angle_rad = 0;
  double speed_rad_s = 0;
  /// Of all that moves with the joint, as it is free to move; the armature is in it.
  double inertia_kg_m2 = 0;
  /// Of gravity, of the other joints with the torques that they were given last, of contacts.
  double body_torque_Nm = 0;
};

/// What a joint is given over one step: mean·(1) + slope·(time from the middle of the step); and
/// where that brings it, as long as the body responds as it did at the beginning.
struct JointTorque {
  double mean_Nm = 0;
  double slope_Nm_s = 0;
  double angle_rad = 0;
  double speed_rad_s = 0;
};

/// A body with joints that drives turn (docs/decisions/0031-a-body-on-the-shafts.md): a pure
/// function of what it is given. It moves in steps of equal length. Joints that nobody drives are
/// free.
class Mechanism {
 public:
  virtual ~Mechanism() = default;
  /// It as it stands, apart from this one.
  virtual std::unique_ptr<Mechanism> clone() const = 0;

  /// Of one step, above 0.
  virtual SimTime step() const = 0;
  /// The names of its joints that a drive can turn.
  virtual std::span<const std::string> joints() const = 0;
  /// At the present instant. `joint` is a place in joints().
  virtual JointView joint(std::size_t joint) const = 0;
  /// Inertia that a drive brings along, kg·m² ≥ 0, from now on; 0 at first. Of several joints;
  /// `update` has to come before anything is read or done.
  virtual void set_armature(std::size_t joint, double inertia_kg_m2) = 0;
  /// Says that armatures were set.
  virtual void update() = 0;
  /// One step under these torques, one for each of joints().
  virtual void advance(std::span<const JointTorque> torques) = 0;
  /// The names of its parts, which can be pushed and loaded; "" is one that cannot.
  virtual std::span<const std::string> parts() const = 0;
  /// From now on, in place of what pushed that part before; world axes, at its centre of mass.
  virtual void push(std::size_t part, const std::array<double, 3>& force_N,
                    const std::array<double, 3>& torque_Nm) = 0;
  /// What the part carries at its centre of mass, kg ≥ 0. `update` has to follow.
  virtual void carry(std::size_t part, double mass_kg) = 0;
  /// It stands still, with joints that nothing turns; or goes on from rest. `update` has to follow.
  virtual void freeze(bool on) = 0;
  /// Its hinge's end stops, rad; nothing: it turns freely.
  virtual std::optional<std::array<double, 2>> stops(std::size_t /*joint*/) const { return {}; }
  /// The names of poses that it brings along; "" is one without a name.
  virtual std::span<const std::string> keyframes() const { return {}; }
  /// Places in parts() of those that go where they like.
  virtual std::span<const std::size_t> free_parts() const { return {}; }
  virtual bool has_floor() const { return false; }
  /// It has one. `update` has to follow.
  virtual void set_floor(const Floor& /*floor*/) {}
  /// Puts it there. `update` has to follow.
  virtual void pose(const Pose& /*pose*/) {}
  /// As it is now, into `state`.
  virtual void look(BodyState& /*state*/) const {}
  /// Why its state means nothing any more, with what went wrong and where; nothing while it does.
  /// It stands still then.
  virtual std::optional<std::string> failure() const = 0;

 protected:
  Mechanism() = default;
  Mechanism(const Mechanism&) = default;
  Mechanism(Mechanism&&) = default;
  Mechanism& operator=(const Mechanism&) = default;
  Mechanism& operator=(Mechanism&&) = default;
};

}  // namespace lk::emulator
