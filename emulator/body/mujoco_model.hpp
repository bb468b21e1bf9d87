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

/// Name of the box for a floor step; at first it has no contacts and is hidden.
inline constexpr const char* kStepGeom = "lk-emu step";

/// Loads an MJCF or URDF file. Adds a kStepGeom to a model with a floor, as geoms cannot be added
/// later. Throws std::invalid_argument with MuJoCo's message.
std::unique_ptr<mjModel, FreeMujoco> load_mujoco_model(const std::string& file);

/// Returns whether the geom can move in the world.
bool geom_moves(const mjModel& model, int geom);

/// Returns the planes of the world body that are not steeper than 60°.
std::vector<int> floor_planes(const mjModel& model);

}  // namespace lk::emulator
