#include "emulator/program/profile_files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "emulator/config/config.hpp"
#include "emulator/config/config_reader.hpp"
#include "emulator/config/profile.hpp"
#include "emulator/rom/durable_file.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kLongestMotorFile = 1'048'576;

std::string small_letters(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

/// What the TOML files there are called, sorted.
std::vector<std::string> names_in(const char* folder) {
  std::vector<std::string> names;
  std::error_code none_there;
  for (const auto& entry : fs::directory_iterator(config_directory() / folder, none_there)) {
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  }
  std::ranges::sort(names);
  return names;
}

fs::path shipped_motor(const std::string& name) {
  return config_directory() / "motors" / (name + ".toml");
}

std::vector<std::string> labels_of(const std::string& name) {
  const fs::path file = shipped_motor(name);
  return motor_labels(read_file(file), file.string());
}

/// The shipped motor of that name or label.
std::optional<std::string> shipped_name(const std::string& motor) {
  const std::string wanted = small_letters(motor);
  const auto known = known_motors();
  if (std::ranges::find(known, wanted) != known.end()) return wanted;
  const auto is_sold_so = [&](const std::string& name) {
    const auto labels = labels_of(name);
    return std::ranges::find(labels, wanted, small_letters) != labels.end();
  };
  const auto found = std::ranges::find_if(known, is_sold_so);
  return found == known.end() ? std::nullopt : std::optional(*found);
}

std::string unknown(const char* what, const std::string& where, const std::string& name,
                    const std::vector<std::string>& known, const std::vector<std::string>& words) {
  if (known.empty()) return "no " + std::string(what) + " files in " + where;
  std::string all;
  for (const auto& one : known) all += (all.empty() ? "" : ", ") + one;
  std::vector<std::string> small;
  for (const auto& word : words) small.push_back(small_letters(word));
  const std::string meant = nearest(small_letters(name), small);
  return "no " + std::string(what) + " \"" + name + "\"" +
         (meant.empty() ? "" : ", did you mean " + meant + "?") + " (in " + where +
         " there are: " + all + "; or give a path to a .toml file)";
}

[[noreturn]] void fail_to_read(const fs::path& file) {
  throw std::invalid_argument("cannot read " + file.string() + ": " + std::strerror(errno));
}

}  // namespace

fs::path config_directory() {
  // LKEMU_CONFIG_DIR leads from the program's directory to its files; the build tree has the same
  // shape. Whether the program still stands there does not count: an upgrade has put another one in
  // its place.
  return (fs::read_symlink("/proc/self/exe").parent_path() / LKEMU_CONFIG_DIR).lexically_normal();
}

std::vector<std::string> known_files(const Shelf& shelf) { return names_in(shelf.folder); }

fs::path shipped_file(const Shelf& shelf, const std::string& name) {
  const auto known = known_files(shelf);
  const fs::path directory = config_directory() / shelf.folder;
  if (std::ranges::find(known, name) == known.end()) {
    throw std::invalid_argument(unknown(shelf.what, directory.string(), name, known, known));
  }
  return directory / (name + ".toml");
}

fs::path meant_file(const Shelf& shelf, const std::string& given) {
  std::error_code none_there;
  const auto here = fs::status(given, none_there);
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
    try {
      return {fs::path(motor).filename().string(), motor,
              read_regular_file(motor, kLongestMotorFile)};
    } catch (const std::invalid_argument& problem) {
      throw UnknownMotor(problem.what());
    }
  }
  const auto name = shipped_name(motor);
  if (!name) {
    throw UnknownMotor(unknown("motor", (config_directory() / "motors").string(), motor,
                               known_motors(), motor_words()));
  }
  const fs::path file = shipped_motor(*name);
  return {*name, file.string(), read_file(file)};
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

std::string read_regular_file(const fs::path& file, std::uintmax_t longest) {
  // By its name first, as opening a device may do something already; then what was opened, as the
  // name may be another's by now.
  struct stat found {};
  if (::stat(file.c_str(), &found) != 0) fail_to_read(file);
  const auto check = [&] {
    if (S_ISREG(found.st_mode)) return;
    throw std::invalid_argument(file.string() + ": is not a regular file");
  };
  check();
  const Descriptor open(::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (!open || ::fstat(open.get(), &found) != 0) fail_to_read(file);
  check();
  // The size says nothing about a file of the kernel's, nor about one that grows.
  std::string text;
  std::array<char, 65'536> piece{};
  while (text.size() <= longest) {
    const ssize_t got = ::read(open.get(), piece.data(), piece.size());
    if (got == 0) return text;
    if (got < 0 && errno != EINTR) fail_to_read(file);
    if (got > 0) text.append(piece.data(), static_cast<std::size_t>(got));
  }
  throw std::invalid_argument(file.string() + ": is longer than " + std::to_string(longest) +
                              " bytes");
}

std::string read_file(const fs::path& file) {
  std::error_code ignored;
  if (fs::is_directory(file, ignored))
    throw std::invalid_argument(file.string() + ": is a directory");
  std::ifstream stream(file, std::ios::binary);
  std::stringstream text;
  // An empty file puts nothing into `text`, which is no mistake of the stream's.
  if (stream) text << stream.rdbuf();
  if (!stream || stream.bad()) fail_to_read(file);
  return text.str();
}

}  // namespace lk::emulator
