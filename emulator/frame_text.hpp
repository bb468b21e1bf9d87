#pragma once

#include <string>

#include "protocol/frame.hpp"

namespace lk::emulator {

/// A frame as candump and cansend write it: "141#9C00000000000000", "141#R", "00000141#…".
std::string frame_text(const protocol::Frame& frame);

}  // namespace lk::emulator
