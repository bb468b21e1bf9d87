#pragma once

#include <csignal>
#include <filesystem>
#include <string>
#include <string_view>

namespace lk::emulator {

/// Blocks all signals while a thread is created. The new thread inherits the mask, so that only the
/// thread of the event loop handles signals. The destructor restores the mask.
class SignalsBlocked {
 public:
  SignalsBlocked() {
    sigset_t all;
    ::sigfillset(&all);
    ::pthread_sigmask(SIG_SETMASK, &all, &before_);
  }
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;
  ~SignalsBlocked() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

 private:
  sigset_t before_{};
};

/// Makes SIGHUP, SIGINT and SIGTERM remove the file `path` before they end the program. Does not
/// change a signal that has a handler or is ignored. `path` must stay valid until
/// `unregister_unfinished`. At most eight files; others are not removed.
void register_unfinished(const char* path);
void unregister_unfinished(const char* path);

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept;
  Descriptor& operator=(Descriptor&& other) noexcept;
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor();

  int get() const { return fd_; }
  explicit operator bool() const { return fd_ >= 0; }

 private:
  int fd_;
};

/// Appends all of `text`, in as many writes as needed. Returns 0 or errno.
int write_all(int fd, std::string_view text);

/// Replaces the file `name` in `directory_fd` by `text` atomically: the file has the old or the new
/// text at any time. Returns 0 when the new text is durable. Otherwise returns errno and restores
/// the old file, except after a power cut or on file systems without RENAME_EXCHANGE.
int write_durably(int directory_fd, const std::string& name, const std::string& text);

/// Makes the entry of this directory in its parent durable, even if another process created it.
/// Returns 0 or errno.
int sync_entry(int directory_fd);

/// Returns the name of the temporary file for a write of `name`. An interrupted write leaves this
/// file behind; it is never read.
std::string unfinished(const std::string& name);

/// Creates `path` and its missing parents, for this user only, durably. Returns 0 or errno. Does
/// not sync existing directories: see `sync_entry`.
int make_directories(const std::filesystem::path& path);

}  // namespace lk::emulator
