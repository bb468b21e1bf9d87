#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"
#include "emulator/ground/terminal_flag.hpp"

namespace lk::emulator {

/// What such a setting of the host's terminal does to packets.
Finding not_raw(TerminalFlag flag);

/// Of a packet of RS-485 with a length of CAN's, or 0x95 without what it needs.
std::optional<Finding> wrong_payload(const protocol::Frame& frame, const KnownDrive& drive);

/// Hosts that send while a drive answers, on one line of RS-485.
class TalkWatch {
 public:
  static constexpr int kTimes = 3;

  /// A packet of a host, whoever it is for. `echoes`: hosts read what they send.
  std::optional<Finding> hear(const TimedFrame& in, bool echoes);
  /// It is one that `drive` answers.
  void expect_reply(const TimedFrame& in, const KnownDrive& drive);

 private:
  /// The packet ends before the drive's reply to the previous one begins: it gets its own reply.
  bool is_queued(const TimedFrame& in) const;
  /// When the packet's last byte has left, queued behind the previous packet.
  SimTime end_of(const TimedFrame& in) const;

  SimTime sent_{0};          // the last packet that is answered: when,
  std::uint32_t asked_ = 0;  // its identifier,
  SimTime byte_time_{0};
  SimTime own_end_{0};  // when it was over,
  SimTime reply_begins_{
      0};  // earliest begin of the first waiting reply; 0: drives do not hear meanwhile
  SimTime reply_ends_{0};  // earliest end of the last waiting reply
  int over_ = 0;
  int after_echo_ = 0;
};

/// Packets whose sums a host makes by another rule.
class SumWatch {
 public:
  static constexpr int kTimes = 3;

  /// Bytes that were no packet.
  std::optional<Finding> hear(const protocol::Frame& frame);

 private:
  static constexpr std::size_t kRules = 3;
  std::array<int, kRules> times_{};
};

}  // namespace lk::emulator
