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
  /// For the second of two 0x07: a boot is over by then (assumed).
  static constexpr SimTime kRestart = std::chrono::seconds(1);
  /// A host that looks for the drive has begun by then.
  static constexpr SimTime kScan = std::chrono::seconds(10);
  static constexpr int kOldPlace = 10;  // queries to the ID that the drive had (assumed)

  /// A frame of 8 bytes for the drive; how it was looked at last may be from before.
  std::vector<Finding> hear(SimTime at, const protocol::Payload& data, const KnownDrive& drive);
  void hear_reply(const protocol::Payload& data);
  /// A frame of a host for another ID than that of the drive.
  std::optional<Finding> hear_elsewhere(SimTime at, int id, const KnownDrive& drive);

 private:
  std::optional<Finding> hear_restart(SimTime at, const KnownDrive& drive);
  std::optional<Finding> lost_place(SimTime at);

  bool pending_ = false;             // acknowledged and not saved
  std::uint32_t pending_start_ = 0;  // in which
  std::uint32_t start_ = 1;          // of the drive, at its last frame
  std::optional<int> new_id_;        // acknowledged
  int old_id_ = 0;                   // where it was asked
  bool saved_id_ = false;
  std::optional<SimTime> moved_;       // when it has restarted with the new ID
  int old_place_ = 0;                  // queries since
  std::optional<SimTime> restarted_;   // the last 0x07
  std::uint32_t restarted_start_ = 0;  // in which
};

/// A number of the one table under the command of the other.
std::optional<Finding> mixed_up_tables(const protocol::Payload& data);

}  // namespace lk::emulator
