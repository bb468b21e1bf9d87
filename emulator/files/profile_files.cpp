#include "emulator/files/profile_files.hpp"

#include <algorithm>
#include <iterator>
#include <regex>
#include <set>
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

/// A shipped motor and the words that find it: its name, then its labels.
struct MotorWords {
  std::string name;
  std::vector<std::string> words;
};

std::vector<MotorWords> called_motors() {
  std::vector<MotorWords> motors;
  for (const std::string& name : known_motors()) {
    motors.push_back({name, {name}});
    for (std::string& label : labels_of(name)) motors.back().words.push_back(std::move(label));
  }
  return motors;
}

/// Returns the names of motors with a word that `fits` accepts in lower case.
template <typename Fits>
std::vector<std::string> names_with(const std::vector<MotorWords>& motors, Fits fits) {
  std::vector<std::string> names;
  for (const MotorWords& motor : motors) {
    if (std::ranges::any_of(motor.words, fits, small_letters)) names.push_back(motor.name);
  }
  return names;
}

/// Removes the version of a motor from its label: "mg4005e-i10v3" becomes "mg4005-i10".
std::string without_version(const std::string& label) {
  static const std::regex encoder("^([a-z]+[0-9]{4})e");
  static const std::regex version("-?v[0-9]+(?=-|$)");
  return std::regex_replace(std::regex_replace(label, encoder, "$1"), version, "");
}

/// Returns true if the labels of motors of this size ("mg5010") name more than one gear.
bool has_several_gears(const std::vector<MotorWords>& motors, const std::string& size) {
  std::set<int> gears;
  for (const MotorWords& motor : motors) {
    for (const std::string& word : motor.words) {
      const auto gear =
          small_letters(word).starts_with(size) ? label_facts(word).gear : std::nullopt;
      if (gear) gears.insert(*gear);
    }
  }
  return gears.size() > 1;
}

/// Finds a shipped motor by name or label; if none, the only motor that differs just in version.
std::optional<std::string> shipped_name(const std::string& motor) {
  const std::string wanted = small_letters(motor);
  const auto motors = called_motors();
  auto found = names_with(motors, [&](const std::string& word) { return word == wanted; });
  const std::string plain = without_version(wanted);
  if (found.empty() && !has_several_gears(motors, plain)) {
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

/// Returns true if the motor has the gear and the winding that the label `wanted` names.
bool has_parts_of(const MotorWords& motor, const std::string& wanted) {
  const LabelFacts asked = label_facts(wanted);
  if (asked.gear && load_profile(motor.name).drive.mechanics.gear_ratio != *asked.gear)
    return false;
  return asked.winding.empty() || std::ranges::any_of(motor.words, [&](const std::string& word) {
           return label_facts(word).winding == asked.winding;
         });
}

/// Returns the label of an LK-TECH motor of the size of an RMD-L or RMD-S: "mf9025" for
/// "rmd-l-9025".
std::string without_rmd(const std::string& label) {
  static const std::regex large("^rmd-?l-?(?=[0-9]{4})"), small("^rmd-?s-?(?=[0-9]{4})");
  return std::regex_replace(std::regex_replace(label, large, "mf"), small, "ms");
}

/// Returns the word nearest to `wanted`, ignoring case; nullopt if none is near.
std::optional<std::string> nearest(const std::string& wanted,
                                   const std::vector<std::string>& words) {
  std::vector<std::string> small;
  std::ranges::transform(words, std::back_inserter(small), small_letters);
  const auto found = std::ranges::find(small, closest_match(wanted, small));
  if (found == small.end()) return std::nullopt;
  return words[static_cast<std::size_t>(found - small.begin())];
}

/// Returns the words of a motor that begin with `wanted`; if none, those with which it begins. What
/// follows in an RMD-X, as in RMD-X8-S2, changes its gear.
std::vector<std::string> begun_alike(const MotorWords& motor, const std::string& wanted) {
  constexpr std::size_t kShortest = 3;
  std::vector<std::string> longer;
  std::vector<std::string> shorter;
  for (const std::string& word : motor.words) {
    const std::string small = small_letters(word);
    if (small.starts_with(wanted)) longer.push_back(word);
    if (wanted.starts_with(small) && !small.starts_with("rmd-x")) shorter.push_back(word);
  }
  if (wanted.size() < kShortest) return {};
  return longer.empty() ? shorter : longer;
}

/// Returns words of motors that may be meant; they have the gear and winding of `given`. One word
/// of each motor that begins alike; if there is none, the word with the fewest typing errors.
std::vector<std::string> words_meant(const std::string& given) {
  const std::string wanted = without_rmd(small_letters(given));
  const std::string size = size_of(wanted);
  std::vector<std::string> found;
  std::vector<std::string> alike;
  for (const MotorWords& motor : called_motors()) {
    const std::vector<std::string> begun = begun_alike(motor, wanted);
    std::vector<std::string> of_size;
    std::ranges::copy_if(motor.words, std::back_inserter(of_size), [&](const std::string& word) {
      return !size.empty() && size_of(small_letters(word)) == size;
    });
    if ((begun.empty() && of_size.empty()) || !has_parts_of(motor, wanted)) continue;
    if (!begun.empty()) found.push_back(nearest(wanted, begun).value_or(begun.front()));
    std::ranges::copy(of_size, std::back_inserter(alike));
  }
  if (!found.empty()) return found;
  const auto meant = nearest(wanted, alike);
  return meant ? std::vector{*meant} : found;
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
                               known_motors(), either(words_meant(motor))));
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
