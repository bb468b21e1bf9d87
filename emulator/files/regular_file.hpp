#pragma once

#include <cstdint>
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

}  // namespace lk::emulator
