#pragma once

#include <cstdint>
#include <optional>

#include "emulator/frames/reply_values.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {

/// Whether a frame can be the reply to a query; kEither: it can also be a query.
enum class Fit : std::uint8_t { kNo, kEither, kYes };

/// `command`: DATA[0] of the reply to `query`. The identifier of `reply` is ignored.
Fit reply_fit(const ReplyReader& reader, std::uint8_t command, const protocol::Frame& query,
              const protocol::Frame& reply);

/// Returns true for frames in the format of drives: 11-bit identifier, 8 bytes.
bool is_data(const protocol::Frame& frame);

/// Returns false for a block of the tool (docs/rs485.md) with a length that only queries have.
bool has_length_of_reply(const protocol::Frame& frame);

/// Returns true for a state with a temperature in DATA[1], which hosts rarely send.
bool looks_like_a_state(const protocol::Frame& frame);

}  // namespace lk::emulator
