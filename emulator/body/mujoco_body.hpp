#pragma once

#include <mujoco/mujoco.h>

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "emulator/body/mujoco_model.hpp"
#include "emulator/core/coupling/drawable_body.hpp"
#include "emulator/core/coupling/mechanism.hpp"

namespace lk::emulator {

/// A body simulated by MuJoCo. Drives can turn its hinges. Actuators of the model are disabled, and
/// the drive's armature replaces the model's.
class MujocoBody : public Mechanism, public DrawableBody {
 public:
  /// Loads an MJCF or URDF file and starts in its first keyframe, if any. Divides `step` if the
  /// model needs shorter ones. Throws std::invalid_argument with MuJoCo's message.
  MujocoBody(const std::string& file, SimTime step);
  MujocoBody(const MujocoBody& other);
  MujocoBody(MujocoBody&&) = delete;
  MujocoBody& operator=(const MujocoBody&) = delete;
  MujocoBody& operator=(MujocoBody&&) = delete;
  ~MujocoBody() override = default;

  std::unique_ptr<Mechanism> clone() const override { return std::make_unique<MujocoBody>(*this); }
  SimTime step() const override { return step_; }
  std::span<const std::string> joints() const override { return names_; }
  JointView joint(std::size_t joint) const override;
  void set_armature(std::size_t joint, double inertia_kg_m2) override;
  void update() override;
  void advance(std::span<const JointTorque> torques) override;
  std::span<const std::string> parts() const override { return parts_; }
  void push(std::size_t part, const std::array<double, 3>& force_N,
            const std::array<double, 3>& torque_Nm) override;
  void carry(std::size_t part, double mass_kg) override;
  void freeze(bool on) override;
  std::optional<std::array<double, 2>> stops(std::size_t joint) const override;
  std::span<const std::string> keyframes() const override { return keyframes_; }
  std::span<const std::size_t> free_parts() const override { return free_parts_; }
  bool has_floor() const override { return !planes_.empty(); }
  void set_floor(const Floor& floor) override;
  void pose(const Pose& pose) override;
  void read_state(BodyState& state) const override;
  std::optional<std::string> failure() const override { return failure_; }
  /// Shows groups 0 to 2, as MuJoCo's viewer does. Meshes are shown as bounding boxes, height
  /// fields not at all.
  BodyShape shape() const override;
  unsigned shape_changes() const override { return shape_changes_; }
  std::vector<BodyPose> poses() const override;
  std::vector<BodyContact> contacts() const override;

  const mjModel& model() const { return *model_; }
  const mjData& data() const { return *data_; }

 private:
  void find_joints();
  void find_scene();
  /// Computes and factors A, with A·acceleration = torque + …, including active constraints.
  void find_response();
  void substep(std::span<const JointTorque> torques, double from_s);

  std::unique_ptr<mjModel, FreeMujoco> model_;
  std::unique_ptr<mjData, FreeMujoco> data_;
  SimTime step_;
  int substeps_ = 1;
  std::vector<std::string> names_;
  std::vector<int> hinges_;         // indices of the model's joints
  std::vector<std::string> parts_;  // names of the model's bodies
  std::vector<double> own_kg_;      // masses of these bodies
  std::vector<std::string> keyframes_;
  std::vector<std::size_t> free_parts_;
  std::vector<bool>
      counts_as_fall_;       // by parts_: contact of this part with the world counts as a fall
  std::vector<int> planes_;  // floor: fixed geoms
  int step_geom_ = -1;       // -1: the model has none
  unsigned shape_changes_ = 0;
  Triple level_gravity_{};  // gravity of the model
  bool frozen_ = false;
  bool constants_changed_ = true;  // derived constants must be recomputed
  std::vector<double> response_;   // nv x nv: its Cholesky factor
  std::vector<double> inertia_;    // by names_
  std::vector<double> slopes_;     // nv; this and the next are kept to reuse memory
  std::vector<double> work_;
  std::optional<std::string> failure_;
};

}  // namespace lk::emulator
