#include "emulator/files/rom_store.hpp"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <set>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "emulator/config/bus_name.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/files/durable_file.hpp"
#include "emulator/files/output_file.hpp"

namespace lk::emulator {

/// Returns a function that writes a file durably. Its first write in a directory also makes the
/// entry of that directory durable: without the entry, a power cut loses the file too.
RomWriter::WriteFile RomWriter::write_to_disk() {
  return [durable = std::set<int>()](int directory_fd, const std::string& name,
                                     const std::string& text) mutable {
    int error = durable.contains(directory_fd) ? 0 : sync_entry(directory_fd);
    if (error == 0) {
      durable.insert(directory_fd);
      error = write_durably(directory_fd, name, text);
    }
    return error;
  };
}

RomWriter::RomWriter(OnWritten on_written, WriteFile write_file)
    : on_written_(std::move(on_written)), write_file_(std::move(write_file)) {}

RomWriter::~RomWriter() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void RomWriter::write(const RomFile& place, const RomWrite& write) {
  if (const int error = start(); error != 0) {
    on_written_(place, write, error);
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.insert_or_assign(&place, write).second) order_.push_back(&place);
  }
  changed_.notify_one();
}

int RomWriter::start() {
  if (thread_.joinable()) return 0;
  try {
    const SignalsBlocked blocked;
    thread_ = std::thread([this] { run(); });
    return 0;
  } catch (const std::system_error& problem) {
    return problem.code().value();
  }
}

void RomWriter::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stop_ || !order_.empty(); });
    if (stop_) return;
    const RomFile& place = *order_.front();
    order_.pop_front();
    const RomWrite write = waiting_[&place];
    waiting_.erase(&place);
    lock.unlock();
    const int error =
        write_file_(place.directory_fd, place.name, print_rom(place.owner, write.rom, write.wear));
    on_written_(place, write, error);
    lock.lock();
  }
}

namespace {

namespace fs = std::filesystem;

/// Returns the holder of the lock, "lk-emu (pid 1234)"; "another process" if the holder has not yet
/// written its text.
std::string holder(int lock_fd) {
  std::array<char, 64> text{};
  const ssize_t size = ::pread(lock_fd, text.data(), text.size(), 0);
  const std::string found(text.data(), size > 0 ? static_cast<std::size_t>(size) : 0);
  const std::string line = found.substr(0, found.find('\n'));
  return line.empty() ? "another process" : line;
}

/// Throws StartError if another user controls the opened file or directory. Root may use files of
/// others.
void check(const Descriptor& opened, const fs::path& path) {
  const std::string name = path.string();
  struct stat found {};
  if (::fstat(opened.get(), &found) != 0) {
    throw StartError("cannot access " + name + ": " + errno_text(errno));
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

void remove(const RomFile& place, const fs::path& file) {
  const std::string drive = place.owner.bus + ":" + std::to_string(place.owner.id);
  if (::unlinkat(place.directory_fd, place.name.c_str(), 0) == 0) {
    spdlog::info("{}: ROM wiped, {} removed", drive, file.string());
  } else if (errno != ENOENT) {
    throw StartError("cannot remove " + file.string() + ": " + errno_text(errno));
  }
}

}  // namespace

fs::path state_directory(const char* xdg_state_home, const char* home) {
  // The specification demands to ignore relative paths.
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
  // Opening the lock file succeeds in a directory that is no longer writable if the file exists.
  if (error == 0 && ::faccessat(descriptor(), ".", W_OK | X_OK, AT_EACCESS) != 0) error = errno;
  if (error != 0) {
    throw StartError("cannot keep ROM in " + path.string() + ": " + errno_text(error) + advice);
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
    throw StartError("cannot lock " + path_.string() + ": " + errno_text(errno));
  }
  // Only the message above uses this text, so a failed write, as on a full disk, does no harm.
  const std::string self = "lk-emu (pid " + std::to_string(::getpid()) + ")\n";
  if (::ftruncate(lock_.get(), 0) != 0 || ::pwrite(lock_.get(), self.data(), self.size(), 0) < 0) {
    spdlog::debug("{}: lock: {}", path_.string(), errno_text(errno));
  }
}

// --- files

namespace {

/// Returns the directory for the ROM of a bus: the given one, or the user's; empty if neither
/// exists.
fs::path directory_for(const RomOptions& options, const std::string& bus) {
  if (options.directory) return *options.directory;
  const fs::path base = state_directory(std::getenv("XDG_STATE_HOME"), std::getenv("HOME"));
  return base.empty() ? base : base / bus_file_name(bus);
}

/// Loads the file into `servo`.
void load(const fs::path& file, const std::string& bus, ServoConfig& servo) {
  try {
    read_rom(read_regular_file(file, kLongestRom), file.string(), bus, servo);
  } catch (const ConfigError& problem) {
    throw StartError(std::string(problem.what()) +
                     " (give another --rom DIR, or reset it with --wipe-rom)");
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
      const RomFile place{directory.descriptor(),
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

void load_rom_read_only(const RomOptions& options, std::vector<BusConfig>& buses) {
  if (options.in_memory || options.wipe) return;
  for (BusConfig& bus : buses) {
    const fs::path directory = directory_for(options, bus.interface);
    if (directory.empty()) return;
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
    throw StartError("cannot wipe ROM in " + directory.path().string() + ": " + errno_text(errno));
  }
}

void RomStore::take_directories(const RomOptions& options, const std::vector<BusConfig>& buses) {
  if (options.directory) {
    directories_.emplace_back(*options.directory, "");
    return;
  }
  for (const BusConfig& bus : buses) {
    const fs::path path = directory_for(options, bus.interface);
    if (path.empty()) {
      throw StartError(
          "no directory for ROM: neither HOME nor XDG_STATE_HOME is set; give --rom DIR, or --rom "
          ":memory:");
    }
    directories_.emplace_back(path, "; give --rom DIR, or --rom :memory:");
  }
}

RomGate::RomGate(const BusConfig& bus) {
  for (const ServoConfig& servo : bus.servos) drives_[servo.id].kept = {servo.rom, servo.wear};
}

void RomGate::pass(const TimedFrame& reply, std::vector<protocol::Frame>& out) {
  if (reply.frame.kind == protocol::FrameKind::kError || reply.echo) {
    out.push_back(reply.frame);  // error frames and echoes acknowledge nothing
    return;
  }
  Drive& drive = drives_.at(drive_of(reply));
  if (drive.held.empty() && reply.after_rom_write <= drive.settled) {
    release(drive, reply, out);
  } else if (drive.held.size() < kMaxHeld) {
    drive.held.push_back(reply);
  } else {
    ++lost_replies_;
  }
}

const RomGate::Kept* RomGate::settle(const RomWrite& write, bool durable,
                                     std::vector<protocol::Frame>& out) {
  Drive& drive = drives_.at(write.id);
  if (durable) {
    drive.kept = {write.rom, write.wear};
  } else {
    // Merges consecutive failures to bound `failed`: no reply acknowledges the directive Setting,
    // so any number of such writes may fail.
    if (!drive.failed.empty() && drive.failed.back().last == drive.settled) {
      drive.failed.back().last = write.number;
    } else {
      drive.failed.push_back({drive.settled, write.number});
    }
    ++failed_writes_;
  }
  drive.settled = write.number;
  while (!drive.held.empty() && drive.held.front().after_rom_write <= drive.settled) {
    release(drive, drive.held.front(), out);
    drive.held.pop_front();
  }
  // If a later write is pending, nothing is restored yet: it includes the values of this one.
  return !durable && drive.begun == write.number ? &drive.kept : nullptr;
}

void RomGate::release(Drive& drive, const TimedFrame& reply, std::vector<protocol::Frame>& out) {
  const std::uint64_t number = reply.after_rom_write;
  if (number == 0) {
    out.push_back(reply.frame);
    return;
  }
  while (!drive.failed.empty() && drive.failed.front().last < number) drive.failed.pop_front();
  if (!drive.failed.empty() && number > drive.failed.front().after) {
    ++lost_replies_;
  } else {
    out.push_back(reply.frame);
  }
}

std::size_t RomGate::waiting() const {
  const auto waits = [](const auto& entry) { return entry.second.begun > entry.second.settled; };
  return static_cast<std::size_t>(std::ranges::count_if(drives_, waits));
}

}  // namespace lk::emulator
