// Visible shape of a MujocoBody.

#include <algorithm>

#include "emulator/body/mujoco_body.hpp"
#include "emulator/ground/text.hpp"

namespace lk::emulator {
namespace {

constexpr int kGroupsShown = 3;

Triple triple(const mjtNum* numbers) { return {numbers[0], numbers[1], numbers[2]}; }

Quaternion quaternion(const mjtNum* numbers) {
  return {numbers[0], numbers[1], numbers[2], numbers[3]};
}

/// Index in shape().bodies, which omits the world.
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
  if (name != nullptr) part.name = on_one_line(name);
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

}  // namespace

BodyShape MujocoBody::shape() const {
  const mjModel& m = *model_;
  BodyShape shape;
  for (int body = 1; body < m.nbody; ++body) {
    shape.bodies.push_back(part(m, body));
    if (m.body_weldid[body] != 0) shape.mass_kg += m.body_mass[body];
  }
  for (int n = 0; n < m.ngeom; ++n) {
    if (const auto geom = geom_of(m, n)) shape.geoms.push_back(*geom);
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
    // MuJoCo's force acts on the second geom.
    const int second = model_->geom_bodyid[contact.geom2];
    if (model_->body_weldid[second] == 0) mju_scl3(force, force, -1.0);
    contacts.push_back({triple(contact.pos), triple(force)});
  }
  return contacts;
}

}  // namespace lk::emulator
