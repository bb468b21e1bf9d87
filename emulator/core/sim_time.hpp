#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "protocol/frame.hpp"
#include "protocol/opcodes.hpp"

namespace lk::emulator {

/// Simulated time since the bus was powered on, in integer nanoseconds. The core never reads a
/// clock; the shell relates this time to wall time.
using SimTime = std::chrono::nanoseconds;

constexpr double in_seconds(SimTime time) { return std::chrono::duration<double>(time).count(); }

/// Longest time accepted as input, about three years: sums of such times do not overflow.
inline constexpr SimTime kLongestTime = std::chrono::seconds(100'000'000);

/// A frame and its time. A host's frame has the time at which the host wrote it. A drive's frame
/// has the time at which its last bit ended, or at which the hosts' adapter delivers it.
struct TimedFrame {
  SimTime at{0};
  protocol::Frame frame;
  std::uint64_t after_rom_write = 0;  // of a drive: number of the RomWrite it acknowledges; 0: none
  int drive_id = 0;   // of a drive: ID of the sender if frame.id does not show it; else 0
  bool echo = false;  // the host's own frame, which it reads back
  // Number of the host at its port. The port passes the frame on to the other hosts. 0: the medium
  // has already delivered it to them.
  std::uint32_t sender = 0;

  friend bool operator==(const TimedFrame&, const TimedFrame&) = default;
};

/// Returns the ID of the drive that sent `reply`, 0 for an error frame and other frames of no
/// drive. If `drive_id` is 0, the identifier shows the ID: it is a multiple of 64 plus the ID.
inline int drive_of(const TimedFrame& reply) {
  if (reply.drive_id != 0) return reply.drive_id;
  const auto id = static_cast<int>(reply.frame.id & 0x3FU);
  return reply.frame.kind == protocol::FrameKind::kError || id > protocol::kMaxId ? 0 : id;
}

/// Formats as "1.25 s", to the nanosecond.
std::string time_text(SimTime time);
/// Formats as a number of seconds: "1.25".
std::string seconds_text(SimTime time);

}  // namespace lk::emulator
