#pragma once

#include <string>
#include <string_view>
#include <variant>

#include "protocol/frame.hpp"

namespace lk::emulator {

/// Formats a frame as candump and cansend do: "141#9C00000000000000", "141#R", "00000141#…".
std::string frame_text(const protocol::Frame& frame);

/// Parses such a text; returns the frame or a message for the user. Accepts dots between bytes and
/// lower case. Ignores the payload of a CAN FD frame ("141##0…").
std::variant<protocol::Frame, std::string> parse_frame(std::string_view text);

}  // namespace lk::emulator
