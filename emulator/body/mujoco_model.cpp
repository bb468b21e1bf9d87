#include "emulator/body/mujoco_model.hpp"

#include <mujoco/mjxmacro.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <type_traits>
#include <vector>

#include "emulator/body/mujoco_trial.hpp"
#include "emulator/core/text.hpp"

namespace lk::emulator {

void redirect_mujoco_errors() {
  // Throws, as MuJoCo does not expect the handler to return.
  mju_user_error = [](const char* text) { throw MujocoError(text); };
  mju_user_warning = [](const char* /*text*/) {};
}

std::string mujoco_message(std::string_view text) {
  std::string line;
  for (const char one : text.substr(0, text.find_last_not_of('\n') + 1)) {
    line += one == '\n' ? std::string("; ") : std::string(1, one);
  }
  return sanitized_line(line);
}

namespace {

struct Attribute {
  std::string_view element, name, value;
};

constexpr auto npos = std::string_view::npos;

/// Returns all attributes of the XML `text`. Stops at malformed text, which MuJoCo reports later.
std::vector<Attribute> attributes_of(std::string_view text) {
  std::vector<Attribute> all;
  std::string_view element;
  constexpr const char* kEnds = " \t\r\n/>=";
  for (std::size_t at = 0; (at = text.find_first_of("<\"'", at)) != npos;) {
    if (text.substr(at).starts_with("<!--")) {
      at = text.find("-->", at);
    } else if (text[at] == '<') {
      element = text.substr(at + 1, text.find_first_of(kEnds, at + 1) - at - 1);
      ++at;
    } else {
      const std::size_t end = text.find(text[at], at + 1);
      const std::size_t equals = text.find_last_not_of(" \t\r\n", at - 1);
      if (end == npos || equals == npos || text[equals] != '=') return all;
      const std::size_t last = text.find_last_not_of(" \t\r\n", equals - 1);
      const std::size_t first = text.find_last_of(" \t\r\n", last) + 1;
      all.push_back(
          {element, text.substr(first, last + 1 - first), text.substr(at + 1, end - at - 1)});
      at = end + 1;
    }
  }
  return all;
}

/// Returns true if all words are numbers, so `value` is not a name, and one is not finite.
bool has_odd_number(std::string_view value) {
  std::istringstream words{std::string(value)};
  bool odd = false;
  for (std::string word; words >> word;) {
    char* end = nullptr;
    odd = !std::isfinite(std::strtod(word.c_str(), &end)) || odd;
    if (*end != '\0') return false;
  }
  return odd;
}

template <class Number>
void check_finite(std::span<const Number> values, const std::string& file, const char* name) {
  if constexpr (std::is_floating_point_v<Number>) {
    const auto wrong =
        std::ranges::find_if(values, [](Number value) { return !std::isfinite(value); });
    if (wrong == values.end()) return;
    throw std::invalid_argument(file + ": " + name + "[" + std::to_string(wrong - values.begin()) +
                                "] is not a finite number");
  }
}

}  // namespace

void check_written_numbers(const std::string& file) {
  // Includes are relative to the model's own directory (MuJoCo, XML reference).
  const auto directory = std::filesystem::path(file).parent_path();
  std::vector<std::filesystem::path> left{file};
  std::set<std::filesystem::path> seen;
  while (!left.empty()) {
    const std::filesystem::path one = left.back();
    left.pop_back();
    if (!seen.insert(one).second) continue;
    std::ostringstream text;
    text << std::ifstream(one).rdbuf();
    const std::string held = text.str();
    for (const auto& [element, name, value] : attributes_of(held)) {
      if (element == "include" && name == "file") left.push_back(directory / value);
      if (name == "name" || !has_odd_number(value)) continue;
      throw std::invalid_argument(one.string() + ": " + std::string(name) + "=\"" +
                                  std::string(value) + "\" is not a finite number");
    }
  }
}

void check_model_numbers(const mjModel& model, const std::string& file) {
#define X(type, name) check_finite<type>({&model.opt.name, 1}, file, #name);
  MJOPTION_FLOATS
#undef X
#define X(name, size) check_finite<mjtNum>({&model.opt.name[0], size}, file, #name);
  MJOPTION_VECTORS
#undef X
#undef MJ_M
#define MJ_M(size) model.size
#define X(type, name, rows, columns)                                                          \
  check_finite<type>(                                                                         \
      {model.name, static_cast<std::size_t>(model.rows) * static_cast<std::size_t>(columns)}, \
      file, #name);
  MJMODEL_POINTERS
#undef X
}

namespace {

constexpr double kFloorCosine = 0.5;  // of 60°; assumed: a steeper plane is a wall

using Model = std::unique_ptr<mjModel, FreeMujoco>;

/// Parses the model at `path`. MuJoCo looks for it in `files` before the disk; null: only on the
/// disk. `file` is the name for messages.
Model parse(const std::string& path, const mjVFS* files, const std::string& file) {
  std::array<char, 1000> text{};
  try {
    Model model(mj_loadXML(path.c_str(), files, text.data(), text.size()));
    if (model != nullptr) return model;
  } catch (const MujocoError& problem) {
    throw std::invalid_argument(file + ": " + mujoco_message(problem.what()));
  }
  throw std::invalid_argument(file + ": " + mujoco_message(text.data()));
}

void check(const std::string& file) {
  check_written_numbers(file);
  check_model_numbers(*parse(file, nullptr, file), file);
}

/// Escapes a file name for XML. Unlike xml_escaped, keeps bytes that are not valid UTF-8.
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

/// Parses a model that includes `file` and adds the box kStepGeom, in the directory of `file`, so
/// that MuJoCo finds meshes. Removes the contacts of the box only afterwards, as MuJoCo's compiler
/// may drop a geom without contacts.
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
  redirect_mujoco_errors();
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
