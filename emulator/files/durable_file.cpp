#include "emulator/files/durable_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <string_view>
#include <utility>

namespace lk::emulator {
namespace {

/// Names of unfinished files for the signal handler; null: a free entry.
std::array<std::atomic<const char*>, 8> unfinished_files{};
static_assert(std::atomic<const char*>::is_always_lock_free);

extern "C" void remove_unfinished_and_end(int signal) {
  for (const auto& file : unfinished_files) {
    if (const char* const name = file.load()) ::unlink(name);
  }
  ::signal(signal, SIG_DFL);
  ::raise(signal);
}

/// Installs the handler for signals that have the default action.
void watch_signals() {
  for (const int signal : {SIGHUP, SIGINT, SIGTERM}) {
    struct sigaction present {};
    if (::sigaction(signal, nullptr, &present) != 0 || present.sa_handler != SIG_DFL) continue;
    present.sa_handler = remove_unfinished_and_end;
    ::sigaction(signal, &present, nullptr);
  }
}

void replace_unfinished(const char* before, const char* after) {
  for (auto& file : unfinished_files) {
    const char* expected = before;
    if (file.compare_exchange_strong(expected, after)) return;
  }
}

}  // namespace

void register_unfinished(const char* path) {
  watch_signals();
  replace_unfinished(nullptr, path);
}

void unregister_unfinished(const char* path) { replace_unfinished(path, nullptr); }

namespace {

int sync(int fd) { return ::fsync(fd) == 0 ? 0 : errno; }

int sync_directory(const std::filesystem::path& path) {
  const Descriptor directory(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  return directory ? sync(directory.get()) : errno;
}

/// Creates a file with `text`. First removes a file or link of that name: a link would redirect the
/// write.
int write_file(int directory_fd, const std::string& name, const std::string& text) {
  ::unlinkat(directory_fd, name.c_str(), 0);
  const Descriptor file(::openat(directory_fd, name.c_str(),
                                 O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644));
  if (!file) return errno;
  const int error = write_all(file.get(), text);
  return error != 0 ? error : sync(file.get());
}

/// State of the old file: kept under the temporary name, overwritten, or there was none.
enum class Replaced { kKept, kLost, kNone };

/// Renames `fresh` to `name`. If the file system can exchange names, `fresh` then is the old file.
int rename_over(int directory_fd, const std::string& fresh, const std::string& name,
                Replaced& replaced) {
  const auto rename = [&](unsigned how) {
    return ::renameat2(directory_fd, fresh.c_str(), directory_fd, name.c_str(), how) == 0;
  };
  replaced = Replaced::kKept;
  if (rename(RENAME_EXCHANGE)) return 0;
  replaced = errno == ENOENT ? Replaced::kNone : Replaced::kLost;
  return rename(0) ? 0 : errno;
}

/// Restores the old file: a write that was reported as failed must not appear at the next start.
void restore_old(int directory_fd, const std::string& fresh, const std::string& name,
                 Replaced replaced) {
  if (replaced == Replaced::kKept) {
    ::renameat(directory_fd, fresh.c_str(), directory_fd, name.c_str());
  } else if (replaced == Replaced::kNone) {
    ::unlinkat(directory_fd, name.c_str(), 0);
  }
  sync(directory_fd);  // may succeed now, after the sync that failed
}

}  // namespace

Descriptor::Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

Descriptor::~Descriptor() {
  if (fd_ >= 0) ::close(fd_);
}

std::string unfinished(const std::string& name) { return name + ".new"; }

int write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(fd, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

int write_durably(int directory_fd, const std::string& name, const std::string& text) {
  const std::string fresh = unfinished(name);
  int error = write_file(directory_fd, fresh, text);
  Replaced replaced = Replaced::kKept;
  if (error == 0) error = rename_over(directory_fd, fresh, name, replaced);
  if (error == 0) {
    error = sync(directory_fd);
    if (error != 0) restore_old(directory_fd, fresh, name, replaced);
  }
  ::unlinkat(directory_fd, fresh.c_str(), 0);
  return error;
}

int sync_entry(int directory_fd) {
  const Descriptor above(::openat(directory_fd, "..", O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!above) {
    // Without permission to open the parent, syncs the whole file system instead.
    return errno == EACCES ? (::syncfs(directory_fd) == 0 ? 0 : errno) : errno;
  }
  const int error = sync(above.get());
  // EROFS, EINVAL: the parent is read-only or not on a disk, so it has no changes to lose.
  return error == EROFS || error == EINVAL ? 0 : error;
}

int make_directories(const std::filesystem::path& path) {
  if (::mkdir(path.c_str(), 0700) != 0) {
    if (errno == EEXIST) return 0;  // the caller's open() shows whether it is a directory
    if (errno != ENOENT || !path.has_relative_path()) return errno;
    const int error = make_directories(path.parent_path());
    if (error != 0) return error;
    if (::mkdir(path.c_str(), 0700) != 0) return errno == EEXIST ? 0 : errno;
  }
  // Syncs the parent: a power cut that removes the new directory would remove its files too.
  return sync_directory(path.has_parent_path() ? path.parent_path() : ".");
}

}  // namespace lk::emulator
