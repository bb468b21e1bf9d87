#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>

#include "emulator/files/durable_file.hpp"

namespace lk::emulator {

// Size limits for files that are read, in bytes.
inline constexpr std::uintmax_t kLongestText = 4'194'304;   // a file written by a person
inline constexpr std::uintmax_t kLongestRom = 65'536;       // the ROM file of one drive
inline constexpr std::uintmax_t kLongestLog = 268'435'456;  // a log written by a program

/// Opens an untrusted `file` for reading: rejects files that never end or block. Throws
/// std::invalid_argument.
Descriptor open_regular_file(const std::filesystem::path& file);

/// Opens `file` as `open_regular_file` does and returns its contents. Throws std::invalid_argument,
/// also if it is longer than `longest` bytes.
std::string read_regular_file(const std::filesystem::path& file, std::uintmax_t longest);

/// An output file that appears only when complete: `write` fills a temporary file in the same
/// directory, `commit` renames it. Follows symbolic links and keeps them. Writes directly to other
/// file types (a pipe) and to files that are already open (/dev/stdout). A signal that ends the
/// program removes the temporary file first.
class OutputFile {
 public:
  /// Opens the file. Throws StartError, which names the command-line option `option`.
  OutputFile(const std::filesystem::path& path, const std::string& option);
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  /// Removes the temporary file unless `commit` was called.
  ~OutputFile();

  void write(const std::string& text);
  /// Makes the file appear at its path. Throws StartError if any write has failed.
  void commit();

 private:
  [[noreturn]] void fail(int error) const;
  std::FILE* open();
  void forget_unfinished() const;

  std::filesystem::path path_;        // as given
  std::filesystem::path place_;       // `path_` after following links
  std::filesystem::path unfinished_;  // the file to write; equals `place_` if written directly
  std::string option_;
  std::FILE* stream_ = nullptr;
  int error_ = 0;
};

/// Writes `text` as an OutputFile. Throws StartError.
void write_output(const std::filesystem::path& path, const std::string& option,
                  const std::string& text);

}  // namespace lk::emulator
