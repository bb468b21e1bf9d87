#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/bus_config.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// Reads a command by its word or by its byte: "state_2", 0x9C or "0x9C".
std::optional<std::uint8_t> read_command_or_word(TableReader& reader, const std::string& key);

/// Reads the query for `servo` that the key `command` and the quantities beside it describe.
protocol::Frame read_query(TableReader& reader, const ServoConfig& servo);

}  // namespace lk::emulator
