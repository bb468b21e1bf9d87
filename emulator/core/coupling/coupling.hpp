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
  bool stiff = false;  // is_stiff
};

/// Whether the spring of a gear, with a body of `J_body` at its output, swings faster than a body
/// can follow that is heard once a step: rotor and output are then one to it.
bool is_stiff(const model::MechanicsParams& mechanics, double J_body, SimTime step);

/// The drives of several buses, and what they have in common: the body whose joints they turn, the
/// battery that they draw from, or both. Whoever advances the buses has
/// all of them `reach` each `next_due`, and calls `exchange` there before they go on. A value: a
/// copy has its body for itself.
class Coupling {
 public:
  /// The robot has a body that drives turn, or a battery.
  static bool needed(std::span<const BusConfig> robot);
  /// Of `buses`, which have just been made of `robot`: puts their drives on the joints of its body.
  Coupling(std::span<const BusConfig> robot, std::span<Bus* const> buses);
  /// The drives are put on their joints when the buses have reached `start`, and `begin` is called.
  Coupling(std::unique_ptr<Mechanism> mechanism, std::span<const CoupledDrive> drives,
           SimTime start);
  Coupling(const Coupling& other);
  Coupling(Coupling&&) noexcept = default;
  Coupling& operator=(const Coupling& other);
  Coupling& operator=(Coupling&&) noexcept = default;
  ~Coupling() = default;

  /// When the step ends that is under way; when there is none, when the next one begins.
  SimTime next_due() const { return end_; }
  bool under_way() const { return under_way_; }
  /// Body and battery take the step that the buses have done, and the next one begins.
  void exchange(std::span<Bus* const> buses);
  /// The two halves of it, for a body that takes its time.
  void finish(std::span<Bus* const> buses);
  void begin(std::span<Bus* const> buses);

  /// Null: the drives turn none.
  const Mechanism* body() const { return mechanism_.get(); }
  /// Why the body's state means nothing any more, and when that was; nothing while it does.
  const std::optional<std::string>& failure() const { return failure_; }

 private:
  struct Link {
    std::size_t bus;
    int id;
    JointLink joint;
    bool stiff = false;    // model::Mount has it
    model::Mount mount{};  // at the beginning of the step
    double armature = 0;   // kg·m² at the output: what the body has of the drive in this step
    double torque_Nm = 0;  // on the body at the joint, in the step before
  };
  JointTorque given(const Link& link, const model::MountedShaft& shaft) const;
  /// Does what the buses have told the body. Returns whether it was put somewhere.
  bool take_acts(std::span<Bus* const> buses);
  /// What pushes it yet.
  void push_on();
  bool has_failed();
  /// Puts the drives on the joints as these are now.
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
  BodyState seen_;  // as the step began
  SimTime end_{0};
  bool under_way_ = false;
  SimTime step_;
  std::optional<std::string> failure_;
};

}  // namespace lk::emulator
