#pragma once

#include <filesystem>

namespace lk::emulator {

/// A file that appears with all that is in it, or not at all, and never in place of another one. A
/// signal that would end the program removes what is unfinished first; SIGKILL leaves it beside.
class NewFile {
 public:
  /// Makes it, empty, beside `path`. Throws StartError when `path` is there already, or it cannot
  /// be made.
  explicit NewFile(const std::filesystem::path& path);
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;
  /// What has not been given its name is gone.
  ~NewFile();

  /// Where it is until then.
  const std::filesystem::path& unfinished() const { return unfinished_; }
  /// Gives it its name, durably; nobody has it open any more. Throws StartError when another file
  /// has taken that meanwhile.
  void finish();

 private:
  [[noreturn]] void fail(int error) const;

  std::filesystem::path path_;
  std::filesystem::path unfinished_;
};

}  // namespace lk::emulator
