#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>

#include "emulator/files/durable_file.hpp"

namespace lk::emulator {

// Size limits for files that are read, in bytes.
inline constexpr std::uintmax_t kLongestText = 4'194'304;   // written by a person
inline constexpr std::uintmax_t kLongestRom = 65'536;       // of one drive
inline constexpr std::uintmax_t kLongestLog = 268'435'456;  // written by a program

/// Opens an untrusted `file` for reading: rejects files that never end or block. Throws
/// std::invalid_argument.
Descriptor open_regular_file(const std::filesystem::path& file);

/// Reads such a file. Throws std::invalid_argument, also if it is longer than `longest`.
std::string read_regular_file(const std::filesystem::path& file, std::uintmax_t longest);

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
