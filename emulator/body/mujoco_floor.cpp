// Functions of MujocoBody that change its floor.

#include <algorithm>
#include <cmath>
#include <span>

#include "emulator/body/mujoco_body.hpp"

namespace lk::emulator {
namespace {

constexpr double kStepReach_m = 10;  // half of the length and width of a step; assumed

/// Copies all contact and colour properties of a geom.
void copy_material(mjModel& m, int from, int to) {
  const auto copy = [&](auto* values, int size) {
    std::copy_n(values + size * from, size, values + size * to);
  };
  copy(m.geom_contype, 1);
  copy(m.geom_conaffinity, 1);
  copy(m.geom_condim, 1);
  copy(m.geom_priority, 1);
  copy(m.geom_matid, 1);
  copy(m.geom_rgba, 4);
  copy(m.geom_friction, 3);
  copy(m.geom_solmix, 1);
  copy(m.geom_solref, mjNREF);
  copy(m.geom_solimp, mjNIMP);
  copy(m.geom_margin, 1);
  copy(m.geom_gap, 1);
}

/// MuJoCo uses the larger friction of two geoms in contact. If one geom has a higher priority, only
/// its contact parameters count: gives the floor a higher priority than all moving geoms.
void set_friction(mjModel& model, std::span<const int> floor, double friction) {
  int priority = 0;
  int condim = 3;
  for (int geom = 0; geom < model.ngeom; ++geom) {
    condim = std::max(condim, model.geom_condim[geom]);
    if (geom_moves(model, geom)) priority = std::max(priority, model.geom_priority[geom] + 1);
  }
  for (const int geom : floor) {
    model.geom_friction[3 * geom] = friction;
    model.geom_priority[geom] = std::max(model.geom_priority[geom], priority);
    model.geom_condim[geom] = condim;
  }
}

/// Puts the box `geom` as a step on the geom `plane`, with the same material; height 0 hides it.
void place_step(mjModel& m, int plane, int geom, const FloorStep& step) {
  const bool there = step.height_m > 0;
  copy_material(m, plane, geom);
  if (!there) m.geom_contype[geom] = m.geom_conaffinity[geom] = 0;
  m.geom_group[geom] = there ? m.geom_group[plane] : mjNGROUP - 1;
  const Triple halves = {kStepReach_m, kStepReach_m, std::max(step.height_m, mjMINVAL)};
  std::ranges::copy(halves, m.geom_size + 3 * geom);
  m.geom_rbound[geom] = mju_norm3(halves.data());
  // Axes of the box: the world's x projected on the plane, the direction across, and the normal.
  mjtNum turned[9];
  mju_quat2Mat(turned, m.geom_quat + 4 * plane);
  const Triple normal = {turned[2], turned[5], turned[8]};
  Triple along = {1 - normal[0] * normal[0], -normal[0] * normal[1], -normal[0] * normal[2]};
  mju_normalize3(along.data());
  Triple across;
  mju_cross(across.data(), normal.data(), along.data());
  const mjtNum axes[9] = {along[0],  across[0], normal[0], along[1], across[1],
                          normal[1], along[2],  across[2], normal[2]};
  mju_mat2Quat(m.geom_quat + 4 * geom, axes);
  // Centre of the box: on the plane, so that its lower half is in the ground. Measured from the
  // point of the plane closest to the origin.
  const double above = mju_dot3(m.geom_pos + 3 * plane, normal.data());
  const double ahead = (step.from_x_m - above * normal[0]) / along[0] + kStepReach_m;
  mjtNum* const place = m.geom_pos + 3 * geom;
  for (std::size_t n = 0; n < 3; ++n) place[n] = above * normal[n] + ahead * along[n];
  m.geom_sameframe[geom] = 0;  // the frame of the box no longer equals that of the world
}

}  // namespace

/// Makes a slope by tilting gravity: tilted planes would penetrate the objects on them.
void MujocoBody::set_floor(const Floor& floor) {
  if (floor.friction) {
    std::vector<int> geoms = planes_;
    geoms.push_back(step_geom_);
    set_friction(*model_, geoms, *floor.friction);
  }
  if (floor.slope_rad) {
    const auto [x, y, z] = level_gravity_;
    const double s = std::sin(*floor.slope_rad);
    const double c = std::cos(*floor.slope_rad);
    const Triple tilted = {c * x + s * z, y, c * z - s * x};
    std::ranges::copy(tilted, model_->opt.gravity);
  }
  if (floor.step) {
    place_step(*model_, planes_.front(), step_geom_, *floor.step);
    ++shape_changes_;
  }
}

}  // namespace lk::emulator
