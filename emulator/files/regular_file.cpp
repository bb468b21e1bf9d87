#include "emulator/files/regular_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "emulator/ground/text.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& file, const std::string& why) {
  throw std::invalid_argument(on_one_line(file.string()) + ": " + why);
}

[[noreturn]] void fail_to_read(const fs::path& file) {
  const char* const reason = std::strerror(errno);
  throw std::invalid_argument("cannot read " + on_one_line(file.string()) + ": " + reason);
}

void check(const fs::path& file, const struct stat& found) {
  if (S_ISDIR(found.st_mode)) fail(file, "is a directory");
  if (!S_ISREG(found.st_mode)) fail(file, "is not a regular file");
}

}  // namespace

Descriptor open_regular_file(const fs::path& file) {
  // Checks the name first, as opening a device may have an effect. Then checks the open file, as
  // the name may have changed.
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
  // The size is unreliable for kernel files and for files that grow.
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

}  // namespace lk::emulator
