#pragma once

#include <mujoco/mujoco.h>

#include <memory>
#include <string>
#include <vector>

namespace lk::emulator {

struct FreeMujoco {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
  void operator()(mjData* data) const { mj_deleteData(data); }
};

/// The name of the box that a floor brings along, which touches nothing and is not shown at first.
inline constexpr const char* kStepGeom = "lk-emu step";

/// From an MJCF or URDF file. A model with a floor has a kStepGeom as well, for no geometry can be
/// added later. Throws std::invalid_argument with MuJoCo's words.
std::unique_ptr<mjModel, FreeMujoco> load_mujoco_model(const std::string& file);

/// Whether it can move in the world.
bool geom_moves(const mjModel& model, int geom);

/// What can be stood on: planes of the world itself, unless they are steeper than 60°.
std::vector<int> floor_planes(const mjModel& model);

}  // namespace lk::emulator
