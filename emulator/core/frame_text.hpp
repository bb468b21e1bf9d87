#pragma once

#include <string>
#include <string_view>
#include <variant>

#include "protocol/frame.hpp"

namespace lk::emulator {

/// A frame as candump and cansend write it: "141#9C00000000000000", "141#R", "00000141#…".
std::string frame_text(const protocol::Frame& frame);

/// The frame that such a text is, or what is wrong with it, for a person. Dots between the bytes
/// and lower case are welcome; of a CAN FD frame ("141##0…") the payload is left out.
std::variant<protocol::Frame, std::string> parse_frame(std::string_view text);

}  // namespace lk::emulator
