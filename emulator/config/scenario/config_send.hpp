#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/bus_config.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// Reads a command by its word or by its byte: "state_2", 0x9C or "0x9C".
std::optional<std::uint8_t> read_command_or_word(TableReader& reader, const std::string& key);

/// Reads what a host says at once: the frame of the key `frame`, or the one that `command` and its
/// quantities describe for each drive that `id` or `ids` name, all of the bus without.
std::vector<protocol::Frame> read_frames(TableReader& reader, const BusConfig& bus);

/// Reads the query for `servo` that the key `command` and the quantities beside it describe.
protocol::Frame read_query(TableReader& reader, const ServoConfig& servo);

}  // namespace lk::emulator
