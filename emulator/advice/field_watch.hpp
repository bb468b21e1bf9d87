#pragma once

#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Finds a field that the drive clamps or refuses (ranges: docs/protocol.md).
std::optional<Finding> beyond_range(const Heard& heard, const KnownDrive& drive);

}  // namespace lk::emulator
