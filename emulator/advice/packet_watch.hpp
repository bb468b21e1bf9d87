#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"
#include "emulator/ground/terminal_flag.hpp"

namespace lk::emulator {

/// Returns the effect of such a terminal setting on packets.
Finding not_raw(TerminalFlag flag);

/// Finds an RS-485 packet with the length of CAN, or 0x95 without its payload.
std::optional<Finding> wrong_payload(const protocol::Frame& frame, const KnownDrive& drive);

/// Detects hosts that send while a drive replies on an RS-485 line.
class TalkWatch {
 public:
  static constexpr int kTimes = 3;

  /// Processes a host's packet for any drive. `echoes`: hosts read what they send.
  std::optional<Finding> hear(const TimedFrame& in, bool echoes);
  /// Call after `hear` if `drive` answers the packet.
  void expect_reply(const TimedFrame& in, const KnownDrive& drive);

 private:
  /// Returns true if the packet ends before the drive's reply to the previous one begins.
  bool is_queued(const TimedFrame& in) const;
  /// End of the packet's last byte, queued after the previous packet.
  SimTime end_of(const TimedFrame& in) const;

  SimTime sent_{0};          // last packet that gets a reply: its time,
  std::uint32_t asked_ = 0;  // its identifier,
  SimTime byte_time_{0};
  SimTime own_end_{0};  // its end
  SimTime reply_begins_{
      0};  // earliest begin of the first pending reply; 0: drives do not receive meanwhile
  SimTime reply_ends_{0};  // earliest end of the last pending reply
  int over_ = 0;
  int after_echo_ = 0;
};

/// Detects packets with checksums by a wrong rule.
class SumWatch {
 public:
  static constexpr int kTimes = 3;

  /// Processes bytes that are no valid packet.
  std::optional<Finding> hear(const protocol::Frame& frame);

 private:
  static constexpr std::size_t kRules = 3;
  std::array<int, kRules> times_{};
};

}  // namespace lk::emulator
