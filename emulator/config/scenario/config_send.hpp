#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/bus_config.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// Reads a command by word or byte: "state_2", 0x9C or "0x9C".
std::optional<std::uint8_t> read_command_or_word(TableReader& reader, const std::string& key);

/// Reads the frames that a host sends at the same time: `frame`, or `command` with its values. A
/// `command` gives one frame for each drive in `id` or `ids` (default: all drives of the bus).
std::vector<protocol::Frame> read_frames(TableReader& reader, const BusConfig& bus);

/// Reads the query to `servo` given by `command` and its values.
protocol::Frame read_query(TableReader& reader, const ServoConfig& servo);

}  // namespace lk::emulator
