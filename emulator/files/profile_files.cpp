#include "emulator/files/profile_files.hpp"

#include <algorithm>
#include <regex>
#include <stdexcept>
#include <string>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/config_reader.hpp"
#include "emulator/config/profile.hpp"
#include "emulator/core/coupling/mechanism.hpp"
#include "emulator/core/text.hpp"
#include "emulator/files/output_file.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

/// Returns the names of the files with `extension` in the shipped `folder`, sorted, without
/// extension.
std::vector<std::string> names_in(const char* folder, const char* extension = ".toml") {
  std::vector<std::string> names;
  std::error_code none_there;
  for (const auto& entry : fs::directory_iterator(config_directory() / folder, none_there)) {
    if (entry.path().extension() == extension) names.push_back(entry.path().stem().string());
  }
  std::ranges::sort(names);
  return names;
}

fs::path shipped_motor(const std::string& name) {
  return config_directory() / "motors" / (name + ".toml");
}

std::vector<std::string> labels_of(const std::string& name) {
  const fs::path file = shipped_motor(name);
  return motor_labels(read_regular_file(file, kLongestText), file.string());
}

/// A shipped motor and its words in lower case.
struct MotorWords {
  std::string name;
  std::vector<std::string> words;
};

std::vector<MotorWords> called_motors() {
  std::vector<MotorWords> motors;
  for (const std::string& name : known_motors()) {
    motors.push_back({name, {name}});
    for (const std::string& label : labels_of(name)) {
      motors.back().words.push_back(small_letters(label));
    }
  }
  return motors;
}

/// Returns the names of motors with a word that `fits` accepts.
template <typename Fits>
std::vector<std::string> names_with(const std::vector<MotorWords>& motors, Fits fits) {
  std::vector<std::string> names;
  for (const MotorWords& motor : motors) {
    if (std::ranges::any_of(motor.words, fits)) names.push_back(motor.name);
  }
  return names;
}

/// Removes the version of a motor from its label: "mg4005e-i10v3" becomes "mg4005-i10".
std::string without_version(const std::string& label) {
  static const std::regex encoder("^([a-z]+[0-9]{4})e");
  static const std::regex version("-?v[0-9]+(?=-|$)");
  return std::regex_replace(std::regex_replace(label, encoder, "$1"), version, "");
}

/// Finds a shipped motor by name or label; if none, the only motor that differs just in version.
std::optional<std::string> shipped_name(const std::string& motor) {
  const std::string wanted = small_letters(motor);
  const auto motors = called_motors();
  auto found = names_with(motors, [&](const std::string& word) { return word == wanted; });
  if (found.empty()) {
    const std::string plain = without_version(wanted);
    found =
        names_with(motors, [&](const std::string& word) { return without_version(word) == plain; });
  }
  return found.size() == 1 ? std::optional(found.front()) : std::nullopt;
}

/// Returns series and size of a motor with sorted digits: "mg0045" for "mg4005e-i10". So 4050
/// matches 4005 as a typing error, and 4010 does not. Empty if `word` has no series and size.
std::string size_of(const std::string& word) {
  static const std::regex size("^[a-z]+[0-9]{4}");
  std::smatch found;
  if (!std::regex_search(word, found, size)) return "";
  std::string text = found.str();
  std::sort(text.end() - 4, text.end());
  return text;
}

/// Returns the gear and the winding that a label names, "i36" or "35t"; empty if it names none.
std::string part_of(const std::string& label, const std::regex& part) {
  std::smatch found;
  return std::regex_search(label, found, part) ? found.str(1) : "";
}

/// Returns true if no label of the motor names another gear or winding than the label `wanted`.
bool has_parts_of(const MotorWords& motor, const std::string& wanted) {
  static const std::regex gear("-(i[0-9]+)"), winding("([0-9]+t)$");
  for (const std::regex* const part : {&gear, &winding}) {
    const std::string asked = part_of(wanted, *part);
    const auto differs = [&](const std::string& word) {
      const std::string own = part_of(word, *part);
      return !own.empty() && own != asked;
    };
    if (!asked.empty() && std::ranges::any_of(motor.words, differs)) return false;
  }
  return true;
}

/// Returns motors with a similar name, the same gear and the same winding.
std::vector<std::string> motors_meant(const std::string& given) {
  constexpr std::size_t kShortest = 3;
  const std::string wanted = small_letters(given);
  auto motors = called_motors();
  std::erase_if(motors, [&](const MotorWords& motor) { return !has_parts_of(motor, wanted); });
  auto found = names_with(motors, [&](const std::string& word) {
    return wanted.size() >= kShortest && (word.starts_with(wanted) || wanted.starts_with(word));
  });
  const std::string size = size_of(wanted);
  if (!found.empty() || size.empty()) return found;
  std::vector<std::string> alike;
  for (const MotorWords& motor : motors) {
    std::ranges::copy_if(motor.words, std::back_inserter(alike),
                         [&](const std::string& word) { return size_of(word) == size; });
  }
  const std::string meant = closest_match(wanted, alike);
  return names_with(motors, [&](const std::string& word) { return word == meant; });
}

/// Returns a list for messages: "mg6012-i36 or mg6012-i8".
std::string either(const std::vector<std::string>& words) {
  std::string all;
  for (const auto& word : words) all += (all.empty() ? "" : " or ") + word;
  return all;
}

std::string unknown(const char* what, const std::string& where, const std::string& name,
                    const std::vector<std::string>& known, const std::string& meant) {
  if (known.empty()) return "no " + std::string(what) + " files in " + where;
  return "no " + std::string(what) + " \"" + name + "\"" +
         (meant.empty() ? "" : ", did you mean " + meant + "?") + " (in " + where +
         " there are: " + comma_list(known) + "; or give a path to a .toml file)";
}

/// Returns the message for a missing `file`; names `shipped`, a shipped file that may be meant.
std::string not_there(const fs::path& file, const std::optional<std::string>& shipped) {
  return "cannot read " + file.string() + ": " + std::strerror(ENOENT) +
         (shipped ? "; the shipped one is called " + *shipped : "");
}

bool is_missing(const fs::path& file) {
  std::error_code error;
  return fs::status(file, error).type() == fs::file_type::not_found;
}

/// Reads a motor file given by the user. Throws UnknownMotor.
std::string read_motor_file(const std::string& path) {
  if (sanitized_line(path) != path) {
    throw UnknownMotor("\"" + sanitized_line(path) +
                       "\" is not UTF-8 without control characters; give such a path");
  }
  if (is_missing(path)) throw UnknownMotor(not_there(path, shipped_name(fs::path(path).stem())));
  try {
    return read_regular_file(path, kLongestText);
  } catch (const std::invalid_argument& problem) {
    throw UnknownMotor(problem.what());
  }
}

}  // namespace

fs::path config_directory() {
  // LKEMU_CONFIG_DIR is relative to the program's directory. The build tree has the same layout.
  // /proc/self/exe gives the right directory even after an upgrade has replaced the program.
  return (fs::read_symlink("/proc/self/exe").parent_path() / LKEMU_CONFIG_DIR).lexically_normal();
}

std::vector<std::string> known_files(const Shelf& shelf) { return names_in(shelf.folder); }

fs::path shipped_file(const Shelf& shelf, const std::string& name) {
  const auto known = known_files(shelf);
  const fs::path directory = config_directory() / shelf.folder;
  if (std::ranges::find(known, name) == known.end()) {
    throw std::invalid_argument(unknown(shelf.what, directory.string(), name, known,
                                        closest_match(small_letters(name), known)));
  }
  return directory / (name + ".toml");
}

fs::path meant_file(const Shelf& shelf, const std::string& given) {
  std::error_code none_there;
  const auto here = fs::status(given, none_there);
  const std::string name = fs::path(given).stem();
  const auto shipped = known_files(shelf);
  if (is_path(given) && is_missing(given) && std::ranges::find(shipped, name) != shipped.end()) {
    throw std::invalid_argument(not_there(given, name));
  }
  if (is_path(given) || (fs::exists(here) && !fs::is_directory(here))) return given;
  return shipped_file(shelf, given);
}

std::vector<std::string> known_motors() { return names_in("motors"); }

std::vector<std::string> motor_words() {
  std::vector<std::string> words = known_motors();
  for (const std::string& name : known_motors()) {
    for (const std::string& label : labels_of(name)) words.push_back(label);
  }
  return words;
}

MotorFile find_motor_file(const std::string& motor) {
  if (is_path(motor)) {
    return {fs::path(motor).filename().string(), motor, read_motor_file(motor)};
  }
  const auto name = shipped_name(motor);
  if (!name) {
    throw UnknownMotor(unknown("motor", (config_directory() / "motors").string(), motor,
                               known_motors(), either(motors_meant(motor))));
  }
  const fs::path file = shipped_motor(*name);
  return {*name, file.string(), read_regular_file(file, kLongestText), motor};
}

FindProfile profile_finder(MotorFiles& read) {
  const FindMotorFile find_file = [&read](const std::string& motor) {
    const auto found = read.find(motor);
    return found != read.end() ? found->second
                               : read.emplace(motor, find_motor_file(motor)).first->second;
  };
  return [find_file, known = std::map<std::string, Profile>()](const std::string& motor) mutable {
    const auto found = known.find(motor);
    return found != known.end()
               ? found->second
               : known.emplace(motor, parse_profile(find_file(motor), find_file)).first->second;
  };
}

Profile load_profile(const std::string& motor) {
  return parse_profile(find_motor_file(motor), find_motor_file);
}

namespace {

BodyMaker body_maker = nullptr;

}  // namespace

fs::path body_file(const std::string& robot_file, const std::string& model) {
  // The name of a shipped body has no slash and no extension.
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
  throw std::invalid_argument("no body \"" + model + "\" (in " + shelf.string() +
                              " there are: " + comma_list(names_in("bodies", ".xml")) +
                              "; or give a path to an .xml file)");
}

void use_bodies(BodyMaker maker) { body_maker = maker; }

LoadBody body_loader() {
  if (body_maker == nullptr) return {};
  return [](const std::string& file, const std::string& model, SimTime step) {
    return body_maker(body_file(file, model), step);
  };
}

}  // namespace lk::emulator
