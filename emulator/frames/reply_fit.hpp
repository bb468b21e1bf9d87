#pragma once

#include <cstdint>
#include <optional>

#include "emulator/frames/reply_values.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {

/// Whether a frame can be the reply to a query; kEither: it could be a query just as well.
enum class Fit : std::uint8_t { kNo, kEither, kYes };

/// `command` is DATA[0] that the reply to `query` has. The identifier of `reply` does not matter.
Fit reply_fit(const ReplyReader& reader, std::uint8_t command, const protocol::Frame& query,
              const protocol::Frame& reply);

/// A frame like those that drives and their hosts send: 11-bit identifier, 8 bytes.
bool is_data(const protocol::Frame& frame);

/// False: a block of the tool (docs/rs485.md) with the length that it has in queries only.
bool has_length_of_reply(const protocol::Frame& frame);

/// Drives say such things and hosts hardly do: states, whose DATA[1] is a temperature.
bool looks_like_a_state(const protocol::Frame& frame);

}  // namespace lk::emulator
