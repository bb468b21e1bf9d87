#pragma once

/// @file Messages of the shaft port (lk_shafts.h) as bytes. What is read comes from anybody.

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
/// `why` is cut where it is longer than a message of this kind may be.
ShaftBytes end_message(std::string_view why);

/// A simulator's message, with the records of its kind.
struct ShaftAccept {
  lk_shafts_head head;
  std::vector<lk_shafts_accept> records;
};
struct ShaftStates {
  lk_shafts_head head;
  std::vector<lk_shafts_state> records;
};

/// Cuts what a simulator sends into messages of so many joints.
class ShaftReader {
 public:
  explicit ShaftReader(std::uint32_t joints) : joints_(joints) {}

  struct More {};  // a message is not whole yet
  using Message = std::variant<More, ShaftAccept, ShaftStates, std::string>;
  /// The most that is worth reading now: what is missing of a message. Above 0.
  std::size_t wants() const;
  /// Takes no more bytes than it `wants`. A text says what is wrong; nothing more is read then.
  Message take(std::span<const unsigned char> bytes);

 private:
  std::uint32_t joints_;
  ShaftBytes bytes_;       // of the message that is not whole
  lk_shafts_head head_{};  // of it, where it has come
  std::string wrong_;
};

}  // namespace lk::emulator
