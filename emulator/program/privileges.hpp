#pragma once

#include <filesystem>
#include <vector>

namespace lk::emulator {

/// For good: whatever root, or a capability of the file, allows this process beyond what its user
/// may do. To write at `places` that belong to somebody else root keeps CAP_DAC_OVERRIDE alone.
/// Before there are threads: each has capabilities of its own. Throws StartError.
void give_up_privileges(const std::vector<std::filesystem::path>& places);

}  // namespace lk::emulator
