// Functions of MujocoBody for its visible shape, poses and observed state.

#include <algorithm>
#include <cmath>

#include "emulator/body/mujoco_body.hpp"
#include "emulator/core/text.hpp"
#include "emulator/core/units.hpp"

namespace lk::emulator {
namespace {

constexpr int kGroupsShown = 3;
constexpr int kMaxTriangles = 100'000;  // of all meshes; assumed: 5 MB of JSON

Triple triple(const mjtNum* numbers) { return {numbers[0], numbers[1], numbers[2]}; }

Quaternion quaternion(const mjtNum* numbers) {
  return {numbers[0], numbers[1], numbers[2], numbers[3]};
}

/// Returns the index of MuJoCo's `body` in shape().bodies, which omits the world.
std::size_t place_of(int body) { return static_cast<std::size_t>(body - 1); }

std::optional<GeomKind> kind_of(int type) {
  switch (type) {
    case mjGEOM_PLANE:
      return GeomKind::kPlane;
    case mjGEOM_SPHERE:
      return GeomKind::kSphere;
    case mjGEOM_CAPSULE:
      return GeomKind::kCapsule;
    case mjGEOM_ELLIPSOID:
      return GeomKind::kEllipsoid;
    case mjGEOM_CYLINDER:
      return GeomKind::kCylinder;
    case mjGEOM_BOX:
    case mjGEOM_MESH:
      return GeomKind::kBox;
    default:
      return std::nullopt;
  }
}

BodyPart part(const mjModel& model, int body) {
  BodyPart part;
  const char* const name = mj_id2name(&model, mjOBJ_BODY, body);
  if (name != nullptr) part.name = sanitized_line(name);
  const int joint = model.body_jntadr[body];
  part.free = joint >= 0 && model.jnt_type[joint] == mjJNT_FREE;
  part.mass_kg = model.body_mass[body];
  part.centre_m = triple(model.body_ipos + 3 * body);
  return part;
}

std::optional<BodyGeom> geom_of(const mjModel& model, int n) {
  const auto kind = kind_of(model.geom_type[n]);
  const int material = model.geom_matid[n];
  const float* const colour =
      material >= 0 ? model.mat_rgba + 4 * material : model.geom_rgba + 4 * n;
  if (!kind || model.geom_group[n] >= kGroupsShown || colour[3] == 0.0F) return std::nullopt;
  BodyGeom geom;
  geom.kind = *kind;
  if (model.geom_bodyid[n] > 0) geom.body = place_of(model.geom_bodyid[n]);
  geom.size_m = triple(model.geom_size + 3 * n);
  geom.position_m = triple(model.geom_pos + 3 * n);
  geom.quaternion = quaternion(model.geom_quat + 4 * n);
  std::copy_n(colour, 4, geom.colour.begin());
  return geom;
}

/// Shows a geom as MuJoCo's `mesh`. Copies the mesh at its first use if `triangles` are left for
/// it.
void show_mesh(const mjModel& model, int mesh, int& triangles, BodyGeom& geom, BodyShape& shape) {
  geom.mesh = static_cast<std::size_t>(mesh);
  BodyMesh& copy = shape.meshes[geom.mesh];
  const int count = model.mesh_facenum[mesh];
  if (copy.faces.empty() && count <= triangles) {
    triangles -= count;
    const float* const vertices = model.mesh_vert + 3 * model.mesh_vertadr[mesh];
    const int* const faces = model.mesh_face + 3 * model.mesh_faceadr[mesh];
    copy.vertices_m.assign(vertices, vertices + 3 * model.mesh_vertnum[mesh]);
    copy.faces.assign(faces, faces + 3 * count);
  }
  if (!copy.faces.empty()) geom.kind = GeomKind::kMesh;
}

}  // namespace

BodyShape MujocoBody::shape() const {
  const mjModel& m = *model_;
  BodyShape shape;
  for (int body = 1; body < m.nbody; ++body) {
    shape.bodies.push_back(part(m, body));
    if (m.body_weldid[body] != 0) shape.mass_kg += m.body_mass[body];
  }
  shape.meshes.resize(static_cast<std::size_t>(m.nmesh));
  int triangles = kMaxTriangles;
  for (int n = 0; n < m.ngeom; ++n) {
    auto geom = geom_of(m, n);
    if (!geom) continue;
    if (m.geom_type[n] == mjGEOM_MESH) show_mesh(m, m.geom_dataid[n], triangles, *geom, shape);
    shape.geoms.push_back(*geom);
  }
  for (const int joint : hinges_) {
    shape.joints.push_back({place_of(m.jnt_bodyid[joint]), triple(m.jnt_axis + 3 * joint),
                            triple(m.jnt_pos + 3 * joint)});
  }
  return shape;
}

std::vector<BodyPose> MujocoBody::poses() const {
  std::vector<BodyPose> poses;
  for (int body = 1; body < model_->nbody; ++body) {
    poses.push_back({triple(data_->xpos + 3 * body), quaternion(data_->xquat + 4 * body)});
  }
  return poses;
}

std::vector<BodyContact> MujocoBody::contacts() const {
  std::vector<BodyContact> contacts;
  for (int n = 0; n < data_->ncon; ++n) {
    const mjContact& contact = data_->contact[n];
    if (contact.efc_address < 0) continue;
    mjtNum along_frame[6];
    mj_contactForce(model_.get(), data_.get(), n, along_frame);
    mjtNum force[3];
    mju_rotVecMatT(force, along_frame, contact.frame);
    // MuJoCo's force acts on the second geom. If that is fixed, returns the force on the first.
    const int second = model_->geom_bodyid[contact.geom2];
    if (model_->body_weldid[second] == 0) mju_scl3(force, force, -1.0);
    contacts.push_back({triple(contact.pos), triple(force)});
  }
  return contacts;
}

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

/// Converts a quaternion to rotations about x, then y, then z of the world.
Triple rpy_rad_of(const mjtNum* quaternion) {
  const double w = quaternion[0], x = quaternion[1], y = quaternion[2], z = quaternion[3];
  return {std::atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
          std::asin(std::clamp(2 * (w * y - z * x), -1.0, 1.0)),
          std::atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))};
}

/// Adds the forces of all contacts to `state`. Sets `state.fallen` if a part in `counts_as_fall`,
/// indexed by body, touches the world.
void add_contacts(const mjModel& model, const mjData& data, const std::vector<bool>& counts_as_fall,
                  BodyState& state) {
  for (int n = 0; n < data.ncon; ++n) {
    const mjContact& contact = data.contact[n];
    if (contact.efc_address < 0) continue;
    mjtNum force[6];  // normal component first
    mj_contactForce(&model, &data, n, force);
    const int geoms[2] = {contact.geom1, contact.geom2};
    for (const int geom : geoms) {
      const auto part = static_cast<std::size_t>(model.geom_bodyid[geom]);
      state.parts[part].contact_N += force[0];
      const bool on_world = !geom_moves(model, geom == geoms[0] ? geoms[1] : geoms[0]);
      if (!on_world || !geom_moves(model, geom)) continue;
      state.contact_N += force[0];
      state.fallen = state.fallen || (counts_as_fall[part] && force[0] > 0);
    }
  }
}

}  // namespace

void MujocoBody::find_scene() {
  for (int key = 0; key < model_->nkey; ++key) {
    const char* const name = mj_id2name(model_.get(), mjOBJ_KEY, key);
    keyframes_.push_back(name != nullptr ? sanitized_line(name) : "");
  }
  for (int body = 1; body < model_->nbody; ++body) {
    if (is_free(*model_, body)) free_parts_.push_back(static_cast<std::size_t>(body));
  }
  counts_as_fall_.resize(parts_.size());
  for (int body = 1; body < model_->nbody && !free_parts_.empty(); ++body) {
    const int root = static_cast<int>(free_parts_.front());
    if (model_->body_rootid[body] != root) continue;
    counts_as_fall_[static_cast<std::size_t>(body)] = body == root || !is_end(*model_, body);
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
  std::fill_n(data_->qfrc_applied, m.nv, 0.0);  // torques of the old pose
  std::fill_n(data_->qacc_warmstart, m.nv, 0.0);
}

void MujocoBody::read_state(BodyState& state) const {
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
    const double upright = 1 - 2 * (q[1] * q[1] + q[2] * q[2]);  // cosine of the tilt
    state.fallen = upright < std::cos(kFallen_deg * kRadPerDeg);
  }
  add_contacts(m, *data_, counts_as_fall_, state);
}

}  // namespace lk::emulator
