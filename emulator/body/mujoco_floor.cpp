// Floor of a MujocoBody.

#include <algorithm>
#include <cmath>

#include "emulator/body/mujoco_body.hpp"

namespace lk::emulator {
namespace {

constexpr double kStepReach_m = 10;  // half of its length and width; assumed

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

}  // namespace

/// Tilts gravity instead of the planes, which would penetrate objects on them.
void MujocoBody::set_floor(const Floor& floor) {
  if (floor.friction) set_floor_friction(*floor.friction);
  if (floor.slope_rad) {
    const auto [x, y, z] = level_gravity_;
    const double s = std::sin(*floor.slope_rad);
    const double c = std::cos(*floor.slope_rad);
    const Triple tilted = {c * x + s * z, y, c * z - s * x};
    std::ranges::copy(tilted, model_->opt.gravity);
  }
  if (floor.step) set_floor_step(*floor.step);
}

/// MuJoCo uses the larger friction of two geoms, unless one has a higher priority: then only that
/// one's contact parameters count.
void MujocoBody::set_floor_friction(double friction) {
  int priority = 0;
  int condim = 3;
  for (int geom = 0; geom < model_->ngeom; ++geom) {
    condim = std::max(condim, model_->geom_condim[geom]);
    if (geom_moves(*model_, geom)) priority = std::max(priority, model_->geom_priority[geom] + 1);
  }
  const auto set = [&](int geom) {
    model_->geom_friction[3 * geom] = friction;
    model_->geom_priority[geom] = std::max(model_->geom_priority[geom], priority);
    model_->geom_condim[geom] = condim;
  };
  std::ranges::for_each(planes_, set);
  set(step_geom_);
}

/// Puts a box on the first plane, with the same material.
void MujocoBody::set_floor_step(const FloorStep& step) {
  mjModel& m = *model_;
  const int plane = planes_.front();
  const bool there = step.height_m > 0;
  copy_material(m, plane, step_geom_);
  if (!there) m.geom_contype[step_geom_] = m.geom_conaffinity[step_geom_] = 0;
  m.geom_group[step_geom_] = there ? m.geom_group[plane] : mjNGROUP - 1;
  const Triple halves = {kStepReach_m, kStepReach_m, std::max(step.height_m, mjMINVAL)};
  std::ranges::copy(halves, m.geom_size + 3 * step_geom_);
  m.geom_rbound[step_geom_] = mju_norm3(halves.data());
  // Axes: the world's x projected on the plane, the direction across, and the plane's normal.
  mjtNum turned[9];
  mju_quat2Mat(turned, m.geom_quat + 4 * plane);
  const Triple normal = {turned[2], turned[5], turned[8]};
  Triple along = {1 - normal[0] * normal[0], -normal[0] * normal[1], -normal[0] * normal[2]};
  mju_normalize3(along.data());
  Triple across;
  mju_cross(across.data(), normal.data(), along.data());
  const mjtNum axes[9] = {along[0],  across[0], normal[0], along[1], across[1],
                          normal[1], along[2],  across[2], normal[2]};
  mju_mat2Quat(m.geom_quat + 4 * step_geom_, axes);
  // Centre, half in the ground, measured from the point of the plane closest to the origin.
  const double above = mju_dot3(m.geom_pos + 3 * plane, normal.data());
  const double ahead = (step.from_x_m - above * normal[0]) / along[0] + kStepReach_m;
  mjtNum* const place = m.geom_pos + 3 * step_geom_;
  for (std::size_t n = 0; n < 3; ++n) place[n] = above * normal[n] + ahead * along[n];
  m.geom_sameframe[step_geom_] = 0;  // its frame was that of the world
  ++shape_changes_;
}

}  // namespace lk::emulator
