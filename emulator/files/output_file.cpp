#include "emulator/files/output_file.hpp"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>
#include <stdexcept>

#include "emulator/core/start_error.hpp"
#include "emulator/core/text.hpp"
#include "emulator/files/durable_file.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& file, const std::string& why) {
  throw std::invalid_argument(sanitized_line(file.string()) + ": " + why);
}

[[noreturn]] void fail_to_read(const fs::path& file) {
  const char* const reason = std::strerror(errno);
  throw std::invalid_argument("cannot read " + sanitized_line(file.string()) + ": " + reason);
}

void check(const fs::path& file, const struct stat& found) {
  if (S_ISDIR(found.st_mode)) fail(file, "is a directory");
  if (!S_ISREG(found.st_mode)) fail(file, "is not a regular file");
}

}  // namespace

Descriptor open_regular_file(const fs::path& file) {
  // Checks the file before opening it, as opening a device may have an effect. Checks the open file
  // again, as the name may refer to another file by then.
  struct stat found {};
  if (::stat(file.c_str(), &found) != 0) fail_to_read(file);
  check(file, found);
  Descriptor open(::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (!open || ::fstat(open.get(), &found) != 0) fail_to_read(file);
  check(file, found);
  return open;
}

std::string read_regular_file(const fs::path& file, std::uintmax_t longest) {
  const Descriptor open = open_regular_file(file);
  // Reads until the end: the reported size is wrong for kernel files and for files that grow.
  std::string text;
  std::array<char, 8192> piece{};
  while (text.size() <= longest) {
    const ssize_t got = ::read(open.get(), piece.data(), piece.size());
    if (got == 0) return text;
    if (got < 0 && errno != EINTR) fail_to_read(file);
    if (got > 0) text.append(piece.data(), static_cast<std::size_t>(got));
  }
  fail(file, "is longer than " + std::to_string(longest) + " bytes");
}

namespace {

bool is_link(const fs::path& path) {
  std::error_code ignored;
  return fs::is_symlink(fs::symlink_status(path, ignored));
}

/// Returns true for a link in /proc: it refers to an open file, not to a file name.
bool is_in_proc(const fs::path& link) {
  struct statfs system {};
  const fs::path directory = link.has_parent_path() ? link.parent_path() : ".";
  return ::statfs(directory.c_str(), &system) == 0 && system.f_type == PROC_SUPER_MAGIC;
}

/// Largest number of links that the kernel follows in one path.
constexpr int kMaxLinks = 40;

/// Follows links, except those in /proc.
fs::path follow(fs::path path) {
  std::error_code ignored;
  for (int n = 0; n < kMaxLinks && is_link(path) && !is_in_proc(path); ++n) {
    path = path.parent_path() / fs::read_symlink(path, ignored);
  }
  return path;
}

/// Returns the descriptor of this process to which `link` refers, if any.
std::optional<int> own_descriptor(const fs::path& link) {
  std::error_code error;
  if (!is_link(link) || !fs::equivalent(link.parent_path(), "/proc/self/fd", error)) return {};
  const std::string name = link.filename().string();
  int descriptor = -1;
  std::from_chars(name.data(), name.data() + name.size(), descriptor);
  return descriptor;
}

}  // namespace

OutputFile::OutputFile(const fs::path& path, const std::string& option)
    : path_(path), place_(follow(path)), unfinished_(place_), option_(option) {
  if (path.empty()) throw StartError(option + ": needs a file");
  std::error_code error;
  const fs::file_status status = fs::status(place_, error);
  if (fs::is_directory(status)) fail(EISDIR);
  if (!fs::status_known(status)) fail(error.value());
  if (!is_link(place_) && (!fs::exists(status) || fs::is_regular_file(status))) {
    unfinished_ += ".part-" + std::to_string(::getpid());
  }
  if (unfinished_ != place_) {
    register_unfinished(unfinished_.c_str());
  }
  stream_ = open();
  if (stream_ == nullptr) {
    const int reason = errno;
    forget_unfinished();
    fail(reason);
  }
}

/// If the file is already open in this process, duplicates its descriptor, so that output continues
/// at the present position. Reopening would start at the beginning, and fails for a socket.
std::FILE* OutputFile::open() {
  const auto own = own_descriptor(unfinished_);
  if (!own && unfinished_ == place_) return std::fopen(place_.c_str(), "w");
  if (!own) {
    ::unlink(unfinished_.c_str());  // left by a killed program that had the same PID
    return std::fopen(unfinished_.c_str(), "wx");
  }
  const int copy = ::fcntl(*own, F_DUPFD_CLOEXEC, 0);
  if (copy < 0) return nullptr;
  std::FILE* const stream = ::fdopen(copy, "w");
  const int reason = errno;
  if (stream == nullptr) ::close(copy);
  errno = reason;
  return stream;
}

OutputFile::~OutputFile() {
  if (stream_ != nullptr) {
    std::fclose(stream_);
    if (unfinished_ != place_) ::unlink(unfinished_.c_str());
  }
  forget_unfinished();
}

void OutputFile::forget_unfinished() const { unregister_unfinished(unfinished_.c_str()); }

void OutputFile::write(const std::string& text) {
  errno = 0;
  if (error_ == 0 && std::fwrite(text.data(), 1, text.size(), stream_) != text.size()) {
    error_ = errno != 0 ? errno : EIO;
  }
}

void OutputFile::commit() {
  errno = 0;
  const bool closed = std::fclose(stream_) == 0;
  stream_ = nullptr;
  if (!closed && error_ == 0) error_ = errno != 0 ? errno : EIO;
  if (error_ == 0 && unfinished_ != place_ &&
      std::rename(unfinished_.c_str(), place_.c_str()) != 0) {
    error_ = errno;
  }
  if (error_ == 0) return;
  if (unfinished_ != place_) ::unlink(unfinished_.c_str());
  fail(error_);
}

void OutputFile::fail(int error) const {
  throw StartError(option_ + ": cannot write " + sanitized_line(path_.string()) + ": " +
                   std::strerror(error));
}

void write_output(const std::filesystem::path& path, const std::string& option,
                  const std::string& text) {
  OutputFile file(path, option);
  file.write(text);
  file.commit();
}

}  // namespace lk::emulator
