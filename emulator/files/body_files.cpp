#include "emulator/files/body_files.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/coupling/mechanism.hpp"
#include "emulator/files/profile_files.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

BodyMaker& maker() {
  static BodyMaker made_by = nullptr;
  return made_by;
}

}  // namespace

fs::path body_file(const std::string& robot_file, const std::string& model) {
  // A bare name has no suffix.
  const bool is_path = model.find('/') != std::string::npos || fs::path(model).has_extension();
  if (is_path) {
    const fs::path file = fs::path(robot_file).parent_path() / model;
    std::error_code error;
    if (!fs::exists(file, error)) {
      throw std::invalid_argument(file.string() + ": no such file (a path from the robot file's)");
    }
    return file;
  }
  const fs::path shelf = config_directory() / "bodies";
  const fs::path file = shelf / (model + ".xml");
  std::error_code none_there;
  if (fs::exists(file, none_there)) return file;
  std::vector<std::string> known;
  for (const auto& entry : fs::directory_iterator(shelf, none_there)) {
    if (entry.path().extension() == ".xml") known.push_back(entry.path().stem().string());
  }
  std::ranges::sort(known);
  throw std::invalid_argument("no body \"" + model + "\" (in " + shelf.string() + " there are: " +
                              comma_list(known) + "; or give a path to an .xml file)");
}

void use_bodies(BodyMaker made_by) { maker() = made_by; }

LoadBody body_loader() {
  if (maker() == nullptr) return {};
  return [](const std::string& file, const std::string& model, SimTime step) {
    return maker()(body_file(file, model), step);
  };
}

}  // namespace lk::emulator
