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

/// Appends all of `text`, in as many writes as needed. Returns 0 or errno.
int write_all(int fd, std::string_view text);

/// Replaces the file `name` in `directory_fd` by `text` atomically: it holds the old or the new
/// text at any time. Returns 0 when the new text is durable. Otherwise returns errno and restores
/// the old file, except after a power cut, or on file systems without exchange of names.
int write_durably(int directory_fd, const std::string& name, const std::string& text);

/// Makes the entry of the directory itself durable, whoever created it. Returns 0 or errno.
int sync_entry(int directory_fd);

/// Returns the name that an interrupted write leaves behind; such a file is never read.
std::string unfinished(const std::string& name);

/// Creates `path` and its missing parents, for this user only, durably. Returns 0 or errno.
/// Existing directories may not be synced: see `sync_entry`.
int make_directories(const std::filesystem::path& path);

}  // namespace lk::emulator
