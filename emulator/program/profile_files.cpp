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

std::string unknown_motor(const std::string& name) {
  const auto known = known_motors();
  if (known.empty()) return "no motor files in " + (config_directory() / "motors").string();
  std::string all;
  for (const auto& motor : known) all += (all.empty() ? "" : ", ") + motor;
  const std::string meant = nearest(name, known);
  return "no motor \"" + name + "\"" + (meant.empty() ? "" : ", did you mean " + meant + "?") +
         " (there are: " + all + ")";
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

std::vector<std::string> known_motors() {
  std::vector<std::string> names;
  std::error_code none_there;
  for (const auto& entry : fs::directory_iterator(config_directory() / "motors", none_there)) {
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

fs::path motor_file(const std::string& name) {
  const auto known = known_motors();
  if (std::find(known.begin(), known.end(), name) == known.end())
    throw UnknownMotor(unknown_motor(name));
  return config_directory() / "motors" / (name + ".toml");
}

Profile load_profile(const std::string& name) {
  const fs::path file = motor_file(name);
  return parse_profile(read_file(file), file.string(), name);
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
