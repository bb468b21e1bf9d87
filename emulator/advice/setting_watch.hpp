#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Watches settings that are written (0x42), saved (0x44) and in force after a restart (0x07). Uses
/// only wire traffic, and counts writes that a drive acknowledges.
class SettingWatch {
 public:
  /// Processes a frame of 8 bytes. The state in `drive` may be older than the frame.
  std::vector<Finding> hear(const protocol::Payload& data, const KnownDrive& drive);
  void hear_reply(const protocol::Payload& data);

 private:
  bool pending_ = false;             // acknowledged but not saved
  std::uint32_t pending_start_ = 0;  // start of the drive with that write
  std::uint32_t start_ = 1;          // of the drive, at its last frame
};

/// Finds a parameter number of one table used with a command of the other table.
std::optional<Finding> mixed_up_tables(const protocol::Payload& data);

}  // namespace lk::emulator
