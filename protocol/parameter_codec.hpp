#pragma once

/// @file DATA[1..7] of 0xC0 and 0xC1, which queries and replies share.

#include <cstdint>

#include "protocol/commands.hpp"
#include "protocol/wire.hpp"

namespace lk::protocol {

/// Is `byte` one of kParameterIds?
bool known_parameter(std::uint8_t byte);

/// The id must be a known one.
Parameter get_parameter(const Payload& data);
void put_parameter(Payload& data, const Parameter& parameter);

}  // namespace lk::protocol
