#pragma once

#include <filesystem>

namespace lk::emulator {

/// Makes of a recording that is an MCAP file the directory that it would have been otherwise;
/// `directory` exists and is empty. A file that a kill has cut off is read up to there. Throws
/// StartError when it is no such file, or is damaged.
void unpack_mcap(const std::filesystem::path& file, const std::filesystem::path& directory);

}  // namespace lk::emulator
