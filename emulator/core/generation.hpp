#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// The switches as the drives of a generation have them on a wire (docs/protocol.md §10.1,
/// docs/rs485.md).
Quirks quirks_of(Generation generation, protocol::Framing framing = protocol::Framing::kCan);

/// The word that configuration files and options have for it.
std::string_view generation_name(Generation generation);
/// The generation of that name.
std::optional<Generation> generation_of(std::string_view name);
/// Their names, in the order of Generation.
std::vector<std::string> generation_names();

}  // namespace lk::emulator
