#pragma once

#include <cstdio>
#include <filesystem>
#include <string>

namespace lk::emulator {

/// A file that appears when complete: written beside its place, then renamed. Links are followed
/// and kept. Other file types (a pipe) and files that are already open (/dev/stdout) are written
/// directly. A signal that ends the program removes the unfinished file first.
class OutputFile {
 public:
  /// Throws StartError, which names `option`.
  OutputFile(const std::filesystem::path& path, const std::string& option);
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  /// Removes the file unless it was committed.
  ~OutputFile();

  void write(const std::string& text);
  /// Throws StartError if a write has failed.
  void commit();

 private:
  [[noreturn]] void fail(int error) const;
  std::FILE* open();
  void forget_unfinished() const;

  std::filesystem::path path_;        // as given
  std::filesystem::path place_;       // after following links
  std::filesystem::path unfinished_;  // equals `place_` if written directly
  std::string option_;
  std::FILE* stream_ = nullptr;
  int error_ = 0;
};

/// Writes `text` as an OutputFile. Throws StartError.
void write_output(const std::filesystem::path& path, const std::string& option,
                  const std::string& text);

}  // namespace lk::emulator
