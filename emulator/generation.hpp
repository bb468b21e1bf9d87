#pragma once

#include "emulator/bus_config.hpp"

namespace lk::emulator {

/// What sets a generation of firmware apart (docs/protocol.md §7).
Quirks quirks_of(Generation generation);

}  // namespace lk::emulator
