#pragma once

/// @file Frames in the notation of can-utils, for tests: "141#9A00000000000000".

#include <cstdint>
#include <cstdio>
#include <ostream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "protocol/frame.hpp"

namespace lk::protocol {

// GoogleTest calls this when a comparison fails.
inline void PrintTo(const Frame& frame, std::ostream* out) {
  char text[32];
  std::snprintf(text, sizeof text, frame.extended ? "%08X#" : "%03X#", frame.id);
  *out << text;
  if (frame.kind != FrameKind::kData) {
    *out << "(kind " << static_cast<int>(frame.kind) << ')';
  }
  for (std::size_t k = 0; k < frame.dlc && k < frame.data.size(); ++k) {
    std::snprintf(text, sizeof text, "%02X", frame.data[k]);
    *out << text;
  }
}

}  // namespace lk::protocol

namespace lk::test {

/// Parses a frame as `cansend` does. Spaces and dots between bytes are allowed; an identifier of
/// eight digits is extended; "R" after '#' is a remote request.
inline protocol::Frame frame(std::string_view text) {
  const auto hash = text.find('#');
  if (hash == std::string_view::npos) {
    throw std::invalid_argument("no '#' in " + std::string(text));
  }
  protocol::Frame result;
  result.id =
      static_cast<std::uint32_t>(std::stoul(std::string(text.substr(0, hash)), nullptr, 16));
  result.extended = hash == 8;
  result.dlc = 0;
  std::string digits;
  for (const char c : text.substr(hash + 1)) {
    if (c == 'R') {
      result.kind = protocol::FrameKind::kRemote;
    } else if (c != ' ' && c != '.') {
      digits += c;
    }
  }
  for (std::size_t k = 0; k + 1 < digits.size(); k += 2) {
    result.data.at(result.dlc++) =
        static_cast<std::uint8_t>(std::stoul(digits.substr(k, 2), nullptr, 16));
  }
  return result;
}

}  // namespace lk::test
