#pragma once

#include <mujoco/mujoco.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace lk::emulator {

/// Thrown instead of an error for which MuJoCo would end the process.
struct MujocoError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Stops MuJoCo from ending the process or printing: throws errors as MujocoError; warnings are
/// only counted in mjData.
void redirect_mujoco_errors();

/// Returns MuJoCo's message on one line.
std::string mujoco_message(std::string_view text);

/// Checks that attributes in `file` and its includes are finite: MuJoCo would ignore one that is
/// "nan". Throws std::invalid_argument.
void check_written_numbers(const std::string& file);

/// Checks that all numbers in the compiled model are finite. Throws std::invalid_argument.
void check_model_numbers(const mjModel& model, const std::string& file);

struct FreeMujoco {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
  void operator()(mjData* data) const { mj_deleteData(data); }
};

/// Name of the box that becomes a floor step; hidden and without contacts until it is placed.
inline constexpr const char* kStepGeom = "lk-emu step";

/// Loads an MJCF or URDF file. Adds the box kStepGeom to a model with a floor, as MuJoCo cannot add
/// geoms to a loaded model. Throws std::invalid_argument with MuJoCo's message.
std::unique_ptr<mjModel, FreeMujoco> load_mujoco_model(const std::string& file);

/// Returns whether the geom can move in the world.
bool geom_moves(const mjModel& model, int geom);

/// Returns the plane geoms of the world body that are not steeper than 60°.
std::vector<int> floor_planes(const mjModel& model);

}  // namespace lk::emulator
