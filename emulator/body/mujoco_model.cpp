#include "emulator/body/mujoco_model.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <stdexcept>

#include "emulator/body/mujoco_error.hpp"
#include "emulator/ground/text.hpp"

namespace lk::emulator {
namespace {

using Model = std::unique_ptr<mjModel, FreeMujoco>;

/// `files` are looked at before the disk.
Model parse(const std::string& file, const mjVFS* files) {
  std::array<char, 1000> text{};
  try {
    Model model(mj_loadXML(file.c_str(), files, text.data(), text.size()));
    if (model != nullptr) return model;
  } catch (const MujocoError& problem) {
    throw std::invalid_argument(file + ": " + on_one_line(problem.what()));
  }
  throw std::invalid_argument(file + ": " + on_one_line(text.data()));
}

bool has_floor(const mjModel& model) {
  for (int geom = 0; geom < model.ngeom; ++geom) {
    if (model.geom_type[geom] == mjGEOM_PLANE && !geom_moves(model, geom)) return true;
  }
  return false;
}

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

/// Beside `file`, so that its meshes are found.
Model parse_with_step(const std::string& file) {
  const std::filesystem::path path(file);
  const std::string name = "lk-emu with step.xml";
  const std::string text = "<mujoco><include file=\"" + xml_text(path.filename().string()) +
                           "\"/><worldbody><geom name=\"" + kStepGeom +
                           R"(" type="box" size="1 1 1" contype="0" conaffinity="0" group="5"/>)"
                           "</worldbody></mujoco>";
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  mj_makeEmptyFileVFS(files.get(), name.c_str(), static_cast<int>(text.size()));
  std::ranges::copy(text, static_cast<char*>(files->filedata[0]));
  struct Close {
    void operator()(mjVFS* open) const { mj_deleteVFS(open); }
  };
  const std::unique_ptr<mjVFS, Close> close(files.get());
  return parse((path.parent_path() / name).string(), files.get());
}

}  // namespace

Model load_mujoco_model(const std::string& file) {
  tame_mujoco();
  Model model = parse(file, nullptr);
  return has_floor(*model) ? parse_with_step(file) : std::move(model);
}

bool geom_moves(const mjModel& model, int geom) {
  return model.body_weldid[model.geom_bodyid[geom]] != 0;
}

}  // namespace lk::emulator
