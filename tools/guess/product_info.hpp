#pragma once

#include <optional>
#include <string>

#include "protocol/frame.hpp"

namespace lk::emulator {

/// Names and versions in the reply to 0x12 (docs/rs485.md). Safe to print.
struct ProductInfo {
  std::string driver;    // "DS40R7"
  std::string motor;     // "MS4015"
  std::string firmware;  // "2.35"
};

/// Returns the info from a reply to 0x12; empty for other packets.
std::optional<ProductInfo> product_info(const protocol::Frame& reply);

}  // namespace lk::emulator
