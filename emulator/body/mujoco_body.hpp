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

/// A body simulated by MuJoCo. Drives can turn its named hinge joints. The actuators of the model
/// are disabled. On a joint with a drive, the drive's armature replaces the model's.
class MujocoBody : public Mechanism, public DrawableBody {
 public:
  /// Loads an MJCF or URDF file and starts in its first keyframe, if any. Divides `step` into equal
  /// substeps if it exceeds the model's timestep. Throws std::invalid_argument with MuJoCo's
  /// message.
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
  /// Returns geoms of groups 0 to 2, which MuJoCo's viewer shows, too. Meshes become bounding
  /// boxes; height fields are left out.
  BodyShape shape() const override;
  unsigned shape_changes() const override { return shape_changes_; }
  std::vector<BodyPose> poses() const override;
  std::vector<BodyContact> contacts() const override;

  const mjModel& model() const { return *model_; }
  const mjData& data() const { return *data_; }

 private:
  void find_joints();
  void find_scene();
  /// Computes A and factors it. A is the inertia matrix with all active constraints: A·acceleration
  /// = torque + …
  void find_response();
  void substep(std::span<const JointTorque> torques, double from_s);

  std::unique_ptr<mjModel, FreeMujoco> model_;
  std::unique_ptr<mjData, FreeMujoco> data_;
  SimTime step_;
  int substeps_ = 1;
  std::vector<std::string> names_;
  std::vector<int> hinges_;         // indices of these joints in the model
  std::vector<std::string> parts_;  // names of the model's bodies
  std::vector<double> own_kg_;      // masses of these bodies in the model, kg
  std::vector<std::string> keyframes_;
  std::vector<std::size_t> free_parts_;
  std::vector<bool> counts_as_fall_;  // by parts_: a contact of this part with the world is a fall
  std::vector<int> planes_;           // geoms of the floor
  int step_geom_ = -1;                // geom kStepGeom; -1: the model has none
  unsigned shape_changes_ = 0;
  Triple level_gravity_{};  // gravity in the model file, m/s²
  bool frozen_ = false;
  bool constants_changed_ = true;  // derived constants must be recomputed
  std::vector<double> response_;   // nv x nv: Cholesky factor of A, see find_response()
  std::vector<double> inertia_;    // of each joint in names_
  std::vector<double> slopes_;     // nv; slopes_ and work_ are members to reuse their memory
  std::vector<double> work_;
  std::optional<std::string> failure_;
};

}  // namespace lk::emulator
