#pragma once

/// @file The command of a host program, as a plan has it.

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace lk::emulator {

/// A command line as its words: spaces divide them, and what is in '…' or "…" is kept together.
/// There is no shell: $, * and | are characters as others are. Throws std::invalid_argument where a
/// quotation has no end.
std::vector<std::string> command_words(std::string_view line);

/// Of what is in those words that are files, from `directory`: the host's script, its settings.
/// `so_far`: as text_hash has it.
std::uint64_t files_hash(const std::vector<std::string>& words,
                         const std::filesystem::path& directory, std::uint64_t so_far);

}  // namespace lk::emulator
