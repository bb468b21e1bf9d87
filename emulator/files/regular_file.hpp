#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "emulator/files/durable_file.hpp"

namespace lk::emulator {

// The longest files that are read, in bytes.
inline constexpr std::uintmax_t kLongestText = 4'194'304;   // what a person writes
inline constexpr std::uintmax_t kLongestRom = 65'536;       // of one drive
inline constexpr std::uintmax_t kLongestLog = 268'435'456;  // what a program wrote

/// Opens `file`, which may come from anybody, for reading: nothing that never ends or waits for
/// somebody. Throws std::invalid_argument.
Descriptor open_regular_file(const std::filesystem::path& file);

/// The whole of such a file. Throws std::invalid_argument, also when it is longer than `longest`.
std::string read_regular_file(const std::filesystem::path& file, std::uintmax_t longest);

}  // namespace lk::emulator
