#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// Returns the switches of a generation's drives on a wire (docs/reference/protocol.md §10.1,
/// docs/reference/rs485.md).
Quirks quirks_of(Generation generation, protocol::Framing framing = protocol::Framing::kCan);

/// Returns the name that configuration files and options use.
std::string_view generation_name(Generation generation);
/// Returns the generation of that name; nullopt if unknown.
std::optional<Generation> generation_of(std::string_view name);
/// Returns all names, in the order of Generation.
std::vector<std::string> generation_names();

}  // namespace lk::emulator
