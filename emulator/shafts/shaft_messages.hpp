#pragma once

/// @file Messages of the shaft port (lk_shafts.h) as bytes. Received bytes are not trusted.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "emulator/shafts/lk_shafts.h"

namespace lk::emulator {

using ShaftBytes = std::vector<unsigned char>;

ShaftBytes offer_message(std::span<const lk_shafts_offer> offers, std::uint64_t step_ns);
ShaftBytes torques_message(std::span<const lk_shafts_torque> torques, std::uint32_t steps,
                           std::uint64_t number);
/// Truncates `why` to the longest text of such a message.
ShaftBytes end_message(std::string_view why);

/// Message of a simulator, with its records.
struct ShaftAccept {
  lk_shafts_head head;
  std::vector<lk_shafts_accept> records;
};
struct ShaftStates {
  lk_shafts_head head;
  std::vector<lk_shafts_state> records;
};

/// Splits the bytes of a simulator into messages for this number of joints.
class ShaftReader {
 public:
  explicit ShaftReader(std::uint32_t joints) : joints_(joints) {}

  struct More {};  // the message is incomplete
  using Message = std::variant<More, ShaftAccept, ShaftStates, std::string>;
  /// Number of bytes missing of the message; above 0.
  std::size_t wants() const;
  /// Pre: at most `wants()` bytes. A string is an error, after which nothing more is read.
  Message take(std::span<const unsigned char> bytes);

 private:
  std::uint32_t joints_;
  ShaftBytes bytes_;       // of the incomplete message
  lk_shafts_head head_{};  // its head, if complete
  std::string wrong_;
};

}  // namespace lk::emulator
