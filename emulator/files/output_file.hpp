#pragma once

#include <cstdio>
#include <filesystem>
#include <string>

namespace lk::emulator {

/// A file that appears when it is complete: written beside its place and renamed. Links are
/// followed and stay. What is not a regular file (a pipe) is written as it is, and so is what is
/// open already (/dev/stdout, whatever that leads to). A signal that would end the program removes
/// what is unfinished first.
class OutputFile {
 public:
  /// Throws StartError: `option` says what for.
  OutputFile(const std::filesystem::path& path, const std::string& option);
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  /// What was not committed is gone.
  ~OutputFile();

  void write(const std::string& text);
  /// Throws StartError when anything of it could not be written.
  void commit();

 private:
  [[noreturn]] void fail(int error) const;
  std::FILE* open();
  void forget_unfinished() const;

  std::filesystem::path path_;        // as it was given
  std::filesystem::path place_;       // where links have led
  std::filesystem::path unfinished_;  // the same for what is written as it is
  std::string option_;
  std::FILE* stream_ = nullptr;
  int error_ = 0;
};

/// All of `text` as such a file. Throws StartError.
void write_output(const std::filesystem::path& path, const std::string& option,
                  const std::string& text);

}  // namespace lk::emulator
