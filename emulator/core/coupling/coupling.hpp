#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/bus_config.hpp"
#include "emulator/core/coupling/battery.hpp"
#include "emulator/core/coupling/mechanism.hpp"

namespace lk::emulator {

/// A drive on a joint.
struct CoupledDrive {
  std::size_t bus;
  int id;
  JointLink joint;
  bool stiff = false;  // result of is_stiff
};

/// Returns true if the spring of a gear oscillates too fast for a body that is updated once per
/// `step`. `J_body`, kg·m², is the inertia of the body at its output. The body then treats rotor
/// and output as one inertia.
bool is_stiff(const model::MechanicsParams& mechanics, double J_body, SimTime step);

/// Couples the drives of several buses through a body whose joints they turn, a common battery, or
/// both. The owner of the buses calls `reach(next_due())` of each bus, then `exchange`, and repeats
/// this. A copy has a separate body.
class Coupling {
 public:
  /// Returns true if the robot has a body that drives turn, or a battery.
  static bool needed(std::span<const BusConfig> robot);
  /// Pre: `buses` were just constructed from `robot`. Connects the drives to the joints of the
  /// body.
  Coupling(std::span<const BusConfig> robot, std::span<Bus* const> buses);
  /// The caller calls `begin` when the buses have reached `start`: it connects drives and joints.
  Coupling(std::unique_ptr<Mechanism> mechanism, std::span<const CoupledDrive> drives,
           SimTime start);
  Coupling(const Coupling& other);
  Coupling(Coupling&&) noexcept = default;
  Coupling& operator=(const Coupling& other);
  Coupling& operator=(Coupling&&) noexcept = default;
  ~Coupling() = default;

  /// End of the step under way; without one, the start of the next.
  SimTime next_due() const { return end_; }
  bool under_way() const { return under_way_; }
  /// Ends the step that the buses have completed, for body and battery, and begins the next step.
  void exchange(std::span<Bus* const> buses);
  /// The two halves of `exchange`, for a body that an external simulator computes.
  void finish(std::span<Bus* const> buses);
  void begin(std::span<Bus* const> buses);

  /// Null if the drives turn no body.
  const Mechanism* body() const { return mechanism_.get(); }
  /// Why and when the state of the body became invalid; nullopt while it is valid.
  const std::optional<std::string>& failure() const { return failure_; }

 private:
  struct Link {
    std::size_t bus;
    int id;
    JointLink joint;
    bool stiff = false;    // as in model::Mount
    model::Mount mount{};  // at the start of the step
    double armature = 0;  // kg·m² at the output: drive inertia that the body includes in this step
    double torque_Nm = 0;  // on the body at the joint, in the last step
  };
  JointTorque drive_torque(const Link& link, const model::MountedShaft& shaft) const;
  /// Executes the pending actions of the buses on the body. Returns true if one was a Pose.
  bool take_acts(std::span<Bus* const> buses);
  /// Applies the active pushes.
  void apply_pushes();
  bool has_failed();
  /// Connects the drives to their joints, in the joints' present state, for the next step.
  void mount(std::span<Bus* const> buses);

  std::unique_ptr<Mechanism> mechanism_;
  std::optional<Battery> battery_;
  std::vector<Link> links_;
  std::vector<JointTorque> torques_;  // of all joints, in the last step
  struct Pushing {
    Push push;
    SimTime until;
  };
  std::vector<Pushing> pushing_;
  BodyState state_;  // at the start of the step
  SimTime end_{0};
  bool under_way_ = false;
  SimTime step_;
  std::optional<std::string> failure_;
};

}  // namespace lk::emulator
