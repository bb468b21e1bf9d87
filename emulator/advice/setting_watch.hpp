#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Settings that are written over the bus (0x42), saved (0x44) and in force after a restart (0x07):
/// judged by what is on the wire, for whichever drives acknowledge them.
class SettingWatch {
 public:
  /// A frame of 8 bytes for the drive, whose known state may be from before.
  std::vector<Finding> hear(const protocol::Payload& data, const KnownDrive& drive);
  void hear_reply(const protocol::Payload& data);

 private:
  bool pending_ = false;             // acknowledged and not saved
  std::uint32_t pending_start_ = 0;  // in which
  std::uint32_t start_ = 1;          // of the drive, at its last frame
};

/// A number of the one table under the command of the other.
std::optional<Finding> mixed_up_tables(const protocol::Payload& data);

}  // namespace lk::emulator
