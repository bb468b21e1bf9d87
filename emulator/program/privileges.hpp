#pragma once

#include <filesystem>
#include <vector>

namespace lk::emulator {

/// Gives up all capabilities for good. Root keeps CAP_DAC_OVERRIDE if it writes to `places` of
/// other users. Call before threads start, as each thread has its own capabilities. Throws
/// StartError.
void give_up_privileges(const std::vector<std::filesystem::path>& places);

}  // namespace lk::emulator
