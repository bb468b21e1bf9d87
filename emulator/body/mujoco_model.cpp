#include "emulator/body/mujoco_model.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <stdexcept>

#include "emulator/body/mujoco_error.hpp"
#include "emulator/body/mujoco_numbers.hpp"
#include "emulator/body/mujoco_trial.hpp"

namespace lk::emulator {
namespace {

constexpr double kFloorCosine = 0.5;  // 60 degrees; assumed: a steeper plane is a wall

using Model = std::unique_ptr<mjModel, FreeMujoco>;

/// Parses the model at `path`; `files` are searched before the disk. `file` is for messages.
Model parse(const std::string& path, const mjVFS* files, const std::string& file) {
  std::array<char, 1000> text{};
  try {
    Model model(mj_loadXML(path.c_str(), files, text.data(), text.size()));
    if (model != nullptr) return model;
  } catch (const MujocoError& problem) {
    throw std::invalid_argument(file + ": " + mujoco_words(problem.what()));
  }
  throw std::invalid_argument(file + ": " + mujoco_words(text.data()));
}

void check(const std::string& file) {
  check_written_numbers(file);
  check_model_numbers(*parse(file, nullptr, file), file);
}

/// Escapes a file name; keeps all other bytes, unlike xml_escaped, which replaces invalid text.
std::string xml_text(const std::string& plain) {
  std::string text;
  for (const char one : plain) {
    text += one == '&'   ? "&amp;"
            : one == '"' ? "&quot;"
            : one == '<' ? "&lt;"
                         : std::string(1, one);
  }
  return text;
}

/// Parses in the directory of `file`, so that meshes are found. Contacts are removed afterwards, as
/// the compiler may drop a geom without contacts.
Model parse_with_step(const std::string& file) {
  const std::filesystem::path path(file);
  const std::string name = "lk-emu with step.xml";
  const std::string text = "<mujoco><include file=\"" + xml_text(path.filename().string()) +
                           "\"/><worldbody><geom name=\"" + kStepGeom +
                           R"(" type="box" size="1 1 1" group="5"/>)"
                           "</worldbody></mujoco>";
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  mj_makeEmptyFileVFS(files.get(), name.c_str(), static_cast<int>(text.size()));
  std::ranges::copy(text, static_cast<char*>(files->filedata[0]));
  struct Close {
    void operator()(mjVFS* open) const { mj_deleteVFS(open); }
  };
  const std::unique_ptr<mjVFS, Close> close(files.get());
  Model model = parse((path.parent_path() / name).string(), files.get(), file);
  const int step = mj_name2id(model.get(), mjOBJ_GEOM, kStepGeom);
  model->geom_contype[step] = model->geom_conaffinity[step] = 0;
  return model;
}

}  // namespace

Model load_mujoco_model(const std::string& file) {
  tame_mujoco();
  try_in_child(file, check);
  Model model = parse(file, nullptr, file);
  return floor_planes(*model).empty() ? std::move(model) : parse_with_step(file);
}

bool geom_moves(const mjModel& model, int geom) {
  return model.body_weldid[model.geom_bodyid[geom]] != 0;
}

std::vector<int> floor_planes(const mjModel& model) {
  const mjtNum* const g = model.opt.gravity;
  const double strength = mju_norm3(g);
  std::vector<int> planes;
  for (int geom = 0; geom < model.ngeom; ++geom) {
    if (model.geom_type[geom] != mjGEOM_PLANE || model.geom_bodyid[geom] != 0) continue;
    const mjtNum z[3] = {0, 0, 1};
    mjtNum normal[3];
    mju_rotVecQuat(normal, z, model.geom_quat + 4 * geom);
    if (strength > 0 && mju_dot3(normal, g) > -kFloorCosine * strength) continue;
    planes.push_back(geom);
  }
  return planes;
}

}  // namespace lk::emulator
