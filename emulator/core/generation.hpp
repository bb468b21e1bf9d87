#pragma once

#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// The switches as the drives of a generation have them (docs/protocol.md §10.1).
Quirks quirks_of(Generation generation);

}  // namespace lk::emulator
