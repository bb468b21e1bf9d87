#include "emulator/files/runtime_dir.hpp"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include "emulator/core/start_error.hpp"

namespace lk::emulator {
namespace {

/// Returns the owner of files that this process creates in `directory`: mostly its own user. Under
/// user-mode Linux every process runs as root, but its files belong to the user who started
/// user-mode Linux.
uid_t owner_of_new_files(const std::filesystem::path& directory) {
  const std::string probe = (directory / (".lk-emu-" + std::to_string(::getpid()))).string();
  const int fd = ::open(probe.c_str(), O_CREAT | O_EXCL | O_NOFOLLOW | O_WRONLY | O_CLOEXEC, 0600);
  if (fd < 0) return ::geteuid();
  struct stat made {};
  const bool known = ::fstat(fd, &made) == 0;
  ::close(fd);
  ::unlink(probe.c_str());
  return known ? made.st_uid : ::geteuid();
}

bool is_ours(uid_t owner, const std::filesystem::path& directory) {
  return owner == ::geteuid() || owner == owner_of_new_files(directory);
}

/// Throws StartError if another user controls the directory.
void check_directory(const std::filesystem::path& directory) {
  const std::string name = directory.string();
  struct stat found {};
  if (::lstat(name.c_str(), &found) != 0) {
    throw StartError("cannot access " + name + ": " + errno_text(errno));
  }
  if (!S_ISDIR(found.st_mode)) throw StartError(name + " is not a directory: remove it");
  if (!is_ours(found.st_uid, directory)) throw StartError(name + " belongs to another user");
  if ((found.st_mode & 077) != 0) {
    throw StartError(name + " is open to others: chmod 700 " + name);
  }
}

}  // namespace

std::filesystem::path runtime_directory() {
  const char* const base = std::getenv("XDG_RUNTIME_DIR");
  std::error_code none;
  if (base != nullptr && *base == '/' && std::filesystem::is_directory(base, none)) {
    return std::filesystem::path(base) / "lk-emu";
  }
  return "/tmp/lk-emu-" + std::to_string(::geteuid());
}

void secure_directory(const std::filesystem::path& directory) {
  const std::string name = directory.string();
  if (::mkdir(name.c_str(), 0700) != 0 && errno != EEXIST) {
    throw StartError("cannot make " + name + ": " + errno_text(errno));
  }
  check_directory(directory);
}

bool is_live_socket(const std::filesystem::path& path) {
  const std::string name = path.string();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (name.size() >= sizeof address.sun_path) return false;
  std::copy(name.begin(), name.end(), std::begin(address.sun_path));
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  // Throws, as the socket may be in use: the caller removes it if this returns false.
  if (fd < 0) throw StartError("cannot see whether " + name + " is in use: " + errno_text(errno));
  const int result = ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  // Only ECONNREFUSED shows that no process listens. Other errors, e.g. of a full queue or another
  // socket type, mean that a process listens.
  const bool live = result == 0 || errno != ECONNREFUSED;
  ::close(fd);
  return live;
}

std::vector<std::filesystem::path> live_sockets() {
  std::vector<std::filesystem::path> live;
  std::error_code none;
  const std::filesystem::path directory = runtime_directory();
  if (!std::filesystem::exists(std::filesystem::symlink_status(directory, none))) return live;
  check_directory(directory);
  for (const auto& entry : std::filesystem::directory_iterator(directory, none)) {
    if (entry.is_socket(none) && is_live_socket(entry.path())) live.push_back(entry.path());
  }
  std::ranges::sort(live);
  return live;
}

void remove_dead_sockets() {
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(runtime_directory(), none)) {
    const std::string name = entry.path().stem().string();
    const std::size_t dash = name.rfind('-');
    pid_t pid = 0;
    if (dash == std::string::npos || entry.path().extension() != ".sock") continue;
    std::from_chars(name.data() + dash + 1, name.data() + name.size(), pid);
    // Also checks that the process has ended: a running one may be about to listen.
    const bool gone = pid > 0 && ::kill(pid, 0) != 0 && errno == ESRCH;
    if (gone && entry.is_socket(none) && !is_live_socket(entry.path())) {
      ::unlink(entry.path().c_str());
    }
  }
}

void clear_stale_socket(const std::filesystem::path& path) {
  const std::string name = path.string();
  struct stat found {};
  if (::lstat(name.c_str(), &found) != 0) {
    if (errno == ENOENT) return;
    throw StartError("cannot access " + name + ": " + errno_text(errno));
  }
  if (!S_ISSOCK(found.st_mode)) throw StartError(name + " already exists and is not a socket");
  if (!is_ours(found.st_uid, path.parent_path())) {
    throw StartError(name + " belongs to another user");
  }
  if (is_live_socket(path)) throw StartError(name + " is in use by another lk-emu");
  if (::unlink(name.c_str()) != 0 && errno != ENOENT) {
    throw StartError("cannot remove " + name + ": " + errno_text(errno));
  }
}

}  // namespace lk::emulator
