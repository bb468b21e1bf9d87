// Poses and observed state of a MujocoBody.

#include <algorithm>
#include <cmath>

#include "emulator/body/mujoco_body.hpp"
#include "emulator/core/units.hpp"
#include "emulator/ground/text.hpp"

namespace lk::emulator {
namespace {

bool is_free(const mjModel& model, int body) {
  const int joint = model.body_jntadr[body];
  return joint >= 0 && model.jnt_type[joint] == mjJNT_FREE;
}

/// Returns true for the end of a limb: no body is attached to it.
bool is_end(const mjModel& model, int body) {
  const int* const parents = model.body_parentid;
  return std::find(parents + 1, parents + model.nbody, body) == parents + model.nbody;
}

/// Converts rotations about x, then y, then z of the world to a quaternion.
Quaternion quaternion_of(const Triple& rpy_rad) {
  Triple c;
  Triple s;
  for (std::size_t n = 0; n < 3; ++n) {
    c[n] = std::cos(0.5 * rpy_rad[n]);
    s[n] = std::sin(0.5 * rpy_rad[n]);
  }
  return {c[0] * c[1] * c[2] + s[0] * s[1] * s[2], s[0] * c[1] * c[2] - c[0] * s[1] * s[2],
          c[0] * s[1] * c[2] + s[0] * c[1] * s[2], c[0] * c[1] * s[2] - s[0] * s[1] * c[2]};
}

/// Converts a quaternion back to these angles.
Triple rpy_rad_of(const mjtNum* quaternion) {
  const double w = quaternion[0], x = quaternion[1], y = quaternion[2], z = quaternion[3];
  return {std::atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
          std::asin(std::clamp(2 * (w * y - z * x), -1.0, 1.0)),
          std::atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))};
}

}  // namespace

void MujocoBody::find_scene() {
  for (int key = 0; key < model_->nkey; ++key) {
    const char* const name = mj_id2name(model_.get(), mjOBJ_KEY, key);
    keyframes_.push_back(name != nullptr ? on_one_line(name) : "");
  }
  for (int body = 1; body < model_->nbody; ++body) {
    if (is_free(*model_, body)) free_parts_.push_back(static_cast<std::size_t>(body));
  }
  falls_on_.resize(parts_.size());
  for (int body = 1; body < model_->nbody && !free_parts_.empty(); ++body) {
    const int root = static_cast<int>(free_parts_.front());
    if (model_->body_rootid[body] != root) continue;
    falls_on_[static_cast<std::size_t>(body)] = body == root || !is_end(*model_, body);
  }
  planes_ = floor_planes(*model_);
  step_geom_ = mj_name2id(model_.get(), mjOBJ_GEOM, kStepGeom);
  std::copy_n(model_->opt.gravity, 3, level_gravity_.begin());
}

std::optional<std::array<double, 2>> MujocoBody::stops(std::size_t joint) const {
  const int place = hinges_[joint];
  if (model_->jnt_limited[place] == 0) return std::nullopt;
  return std::array{model_->jnt_range[2 * place], model_->jnt_range[2 * place + 1]};
}

void MujocoBody::pose(const Pose& pose) {
  const mjModel& m = *model_;
  if (pose.keyframe) {
    const int key = static_cast<int>(*pose.keyframe);
    std::copy_n(m.key_qpos + key * m.nq, m.nq, data_->qpos);
    if (m.nmocap > 0) {
      std::copy_n(m.key_mpos + 3 * key * m.nmocap, 3 * m.nmocap, data_->mocap_pos);
      std::copy_n(m.key_mquat + 4 * key * m.nmocap, 4 * m.nmocap, data_->mocap_quat);
    }
  }
  if (pose.position_m || pose.rpy_rad) {
    mjtNum* const root = data_->qpos + m.jnt_qposadr[m.body_jntadr[pose.part]];
    if (pose.position_m) std::ranges::copy(*pose.position_m, root);
    if (pose.rpy_rad) std::ranges::copy(quaternion_of(*pose.rpy_rad), root + 3);
  }
  for (const Pose::JointAt& one : pose.joints) {
    data_->qpos[m.jnt_qposadr[hinges_[one.joint]]] = one.angle_rad;
  }
  std::fill_n(data_->qvel, m.nv, 0.0);
  std::fill_n(data_->qfrc_applied, m.nv, 0.0);  // from the old pose
  std::fill_n(data_->qacc_warmstart, m.nv, 0.0);
}

void MujocoBody::look(BodyState& state) const {
  const mjModel& m = *model_;
  state.parts.resize(parts_.size());
  for (int body = 0; body < m.nbody; ++body) {
    PartState& part = state.parts[static_cast<std::size_t>(body)];
    std::copy_n(data_->xpos + 3 * body, 3, part.position_m.begin());
    part.rpy_rad = rpy_rad_of(data_->xquat + 4 * body);
    mjtNum speed[6];  // angular, then linear
    mj_objectVelocity(&m, data_.get(), mjOBJ_XBODY, body, speed, 0);
    std::copy_n(speed + 3, 3, part.speed_m_s.begin());
    part.contact_N = 0;
  }
  state.contact_N = 0;
  state.fallen = false;
  if (!free_parts_.empty()) {
    const mjtNum* const q = data_->xquat + 4 * free_parts_.front();
    const double upright = 1 - 2 * (q[1] * q[1] + q[2] * q[2]);  // z axis along the world's
    state.fallen = upright < std::cos(kFallen_deg * kRadPerDeg);
  }
  look_at_contacts(state);
}

void MujocoBody::look_at_contacts(BodyState& state) const {
  for (int n = 0; n < data_->ncon; ++n) {
    const mjContact& contact = data_->contact[n];
    if (contact.efc_address < 0) continue;
    mjtNum force[6];  // normal component first
    mj_contactForce(model_.get(), data_.get(), n, force);
    const int geoms[2] = {contact.geom1, contact.geom2};
    for (const int geom : geoms) {
      const auto part = static_cast<std::size_t>(model_->geom_bodyid[geom]);
      state.parts[part].contact_N += force[0];
      const bool on_world = !geom_moves(*model_, geom == geoms[0] ? geoms[1] : geoms[0]);
      if (!on_world || !geom_moves(*model_, geom)) continue;
      state.contact_N += force[0];
      state.fallen = state.fallen || (falls_on_[part] && force[0] > 0);
    }
  }
}

}  // namespace lk::emulator
