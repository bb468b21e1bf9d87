#include "emulator/rom/rom_store.hpp"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <stdexcept>

#include "emulator/config/bus_name.hpp"
#include "emulator/files/regular_file.hpp"
#include "emulator/ground/start_error.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

/// Returns "lk-emu (pid 1234)"; a process that has just locked may not have written it yet.
std::string holder(int lock_fd) {
  std::array<char, 64> text{};
  const ssize_t size = ::pread(lock_fd, text.data(), text.size(), 0);
  const std::string found(text.data(), size > 0 ? static_cast<std::size_t>(size) : 0);
  const std::string line = found.substr(0, found.find('\n'));
  return line.empty() ? "another process" : line;
}

/// Throws StartError if another user controls it. Root may use files of others.
void check(const Descriptor& opened, const fs::path& path) {
  const std::string name = path.string();
  struct stat found {};
  if (::fstat(opened.get(), &found) != 0) {
    throw StartError("cannot look at " + name + ": " + reason_of(errno));
  }
  const bool is_directory = S_ISDIR(found.st_mode);
  if (!is_directory && (!S_ISREG(found.st_mode) || found.st_nlink != 1)) {
    throw StartError(name + " is not a file of lk-emu's own: remove it");
  }
  if (::geteuid() != 0 && found.st_uid != ::geteuid()) {
    throw StartError(name + " belongs to another user");
  }
  if ((found.st_mode & (S_IWGRP | S_IWOTH)) != 0) {
    throw StartError(name + " may be written by others: chmod go-w " + name);
  }
}

void remove(const RomPlace& place, const fs::path& file) {
  const std::string drive = place.owner.bus + ":" + std::to_string(place.owner.id);
  if (::unlinkat(place.directory_fd, place.name.c_str(), 0) == 0) {
    spdlog::info("{}: ROM wiped, {} removed", drive, file.string());
  } else if (errno != ENOENT) {
    throw StartError("cannot remove " + file.string() + ": " + reason_of(errno));
  }
}

}  // namespace

fs::path state_directory(const char* xdg_state_home, const char* home) {
  // The specification ignores relative paths.
  if (xdg_state_home != nullptr && *xdg_state_home == '/') {
    return fs::path(xdg_state_home) / "lk-emu";
  }
  if (home != nullptr && *home == '/') return fs::path(home) / ".local/state/lk-emu";
  return {};
}

// --- directory

RomDirectory::RomDirectory(const fs::path& path, const std::string& advice) : path_(path) {
  int error = make_directories(path);
  if (error == 0) {
    directory_ = Descriptor(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!directory_) error = errno;
  }
  if (error == 0) {
    check(directory_, path);
    lock_ = Descriptor(::openat(descriptor(), "lock",
                                O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0644));
    if (!lock_ && errno == ELOOP)
      throw StartError((path / "lock").string() + " is a link: remove it");
    if (!lock_) error = errno;
  }
  // The lock file may exist from a time when the directory was writable.
  if (error == 0 && ::faccessat(descriptor(), ".", W_OK | X_OK, AT_EACCESS) != 0) error = errno;
  if (error != 0) {
    throw StartError("cannot keep ROM in " + path.string() + ": " + reason_of(error) + advice);
  }
  check(lock_, path / "lock");
  lock();
}

void RomDirectory::lock() {
  if (::flock(lock_.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno == EWOULDBLOCK) {
      throw StartError(path_.string() + " is in use by " + holder(lock_.get()) +
                       "; stop it, or give another --rom DIR");
    }
    throw StartError("cannot lock " + path_.string() + ": " + reason_of(errno));
  }
  // Text for the message above only: a full disk does no harm here.
  const std::string self = "lk-emu (pid " + std::to_string(::getpid()) + ")\n";
  if (::ftruncate(lock_.get(), 0) != 0 || ::pwrite(lock_.get(), self.data(), self.size(), 0) < 0) {
    spdlog::debug("{}: lock: {}", path_.string(), reason_of(errno));
  }
}

// --- files

namespace {

/// Loads the file into `servo`.
void load(const fs::path& file, const std::string& bus, ServoConfig& servo) {
  try {
    read_rom(read_regular_file(file, kLongestRom), file.string(), bus, servo);
  } catch (const ConfigError& problem) {
    throw StartError(std::string(problem.what()) +
                     " (give another --rom DIR, or start anew with --wipe-rom)");
  } catch (const std::invalid_argument& problem) {
    throw StartError(problem.what());
  }
}

}  // namespace

RomStore::RomStore(const RomOptions& options, std::vector<BusConfig>& buses) {
  take_directories(options, buses);
  for (std::size_t i = 0; i < buses.size(); ++i) {
    const RomDirectory& directory = directory_of(i);
    const std::string& bus = buses[i].interface;
    for (ServoConfig& servo : buses[i].servos) {
      const RomPlace place{directory.descriptor(),
                           rom_file_name(bus, servo.id),
                           i,
                           {bus, servo.id, servo.profile.name}};
      ::unlinkat(place.directory_fd, unfinished(place.name).c_str(), 0);
      const bool there =
          ::faccessat(place.directory_fd, place.name.c_str(), F_OK, AT_SYMLINK_NOFOLLOW) == 0 ||
          errno != ENOENT;
      if (there && !options.wipe) load(directory.path() / place.name, bus, servo);
      places_.emplace(std::pair(i, servo.id), place);
    }
  }
}

void peek_rom(const RomOptions& options, std::vector<BusConfig>& buses) {
  if (options.in_memory || options.wipe) return;
  const fs::path base = state_directory(std::getenv("XDG_STATE_HOME"), std::getenv("HOME"));
  if (!options.directory && base.empty()) return;
  for (BusConfig& bus : buses) {
    const fs::path directory =
        options.directory ? fs::path(*options.directory) : base / bus_file_name(bus.interface);
    for (ServoConfig& servo : bus.servos) {
      const fs::path file = directory / rom_file_name(bus.interface, servo.id);
      if (std::error_code error; fs::exists(fs::symlink_status(file, error))) {
        load(file, bus.interface, servo);
      }
    }
  }
}

void RomStore::wipe() {
  for (const auto& [of, place] : places_) {
    remove(place, directory_of(of.first).path() / place.name);
  }
  for (const RomDirectory& directory : directories_) {
    if (::fsync(directory.descriptor()) == 0) continue;
    throw StartError("cannot wipe ROM in " + directory.path().string() + ": " + reason_of(errno));
  }
}

void RomStore::take_directories(const RomOptions& options, const std::vector<BusConfig>& buses) {
  if (options.directory) {
    directories_.emplace_back(*options.directory, "");
    return;
  }
  const fs::path base = state_directory(std::getenv("XDG_STATE_HOME"), std::getenv("HOME"));
  if (base.empty()) {
    throw StartError(
        "nowhere to keep ROM: neither HOME nor XDG_STATE_HOME is set; give --rom DIR, or "
        "--rom :memory:");
  }
  for (const BusConfig& bus : buses) {
    directories_.emplace_back(base / bus_file_name(bus.interface),
                              "; give --rom DIR, or --rom :memory:");
  }
}

}  // namespace lk::emulator
