#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace lk::emulator {

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

/// Appends all of `text`, however many writes that takes. Returns 0 or errno.
int write_all(int fd, std::string_view text);

/// Puts `text` into the file `name` of the directory `directory_fd`, all of it or nothing: whatever
/// happens, the file holds what it held before or `text`. Returns 0 once that is durable, else
/// errno; then it holds what it held before, but for a power cut, and for file systems that cannot
/// exchange two names.
int write_durably(int directory_fd, const std::string& name, const std::string& text);

/// Makes the entry of the directory itself durable, whoever made it. Returns 0 or errno.
int sync_entry(int directory_fd);

/// What a write that was cut short leaves behind; nobody reads it.
std::string unfinished(const std::string& name);

/// Makes `path` and what is missing above it, for this user alone, durably. Returns 0 or errno.
/// What was there before may have been made by somebody who did not sync it: see `sync_entry`.
int make_directories(const std::filesystem::path& path);

}  // namespace lk::emulator
