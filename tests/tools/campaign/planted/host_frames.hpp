#pragma once

/// @file What the planted hosts say and hear, byte by byte as such hosts do it (docs/protocol.md,
/// `legacy`), of the drive 1.

#include <cmath>
#include <cstdint>
#include <map>
#include <string>

#include "emulator/core/sim_time.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator::planted {

using namespace std::chrono_literals;

enum : std::uint8_t {
  kOff = 0x80,
  kStop = 0x81,
  kRun = 0x88,
  kReadAngle = 0x92,
  kReadState1 = 0x9A,
  kClearErrors = 0x9B,
  kReadState2 = 0x9C,
  kTorque = 0xA1,
  kSpeed = 0xA2,
  kPosition = 0xA4,
  kTurn = 0xA8,
};

inline protocol::Frame say(std::uint8_t command) {
  protocol::Frame frame{.id = 0x141};
  frame.data[0] = command;
  return frame;
}

inline void put(protocol::Frame& frame, std::size_t first, std::size_t size, double value) {
  auto bits = static_cast<std::uint64_t>(std::llround(value));
  for (std::size_t n = first; n < first + size; ++n, bits >>= 8) {
    frame.data[n] = static_cast<std::uint8_t>(bits);
  }
}

inline protocol::Frame say_torque(double iq_A) {
  protocol::Frame frame = say(kTorque);
  put(frame, 4, 2, iq_A / 0.016);
  return frame;
}
inline protocol::Frame say_speed(double speed_dps) {
  protocol::Frame frame = say(kSpeed);
  put(frame, 4, 4, speed_dps * 100);
  return frame;
}
/// To an angle, or by an angle from the last target.
inline protocol::Frame say_move(std::uint8_t command, double angle_deg, double max_speed_dps) {
  protocol::Frame frame = say(command);
  put(frame, 2, 2, max_speed_dps);
  put(frame, 4, 4, angle_deg * 100);
  return frame;
}

inline std::int64_t read_signed(const protocol::Frame& frame, std::size_t first, std::size_t size) {
  std::uint64_t bits = 0;
  for (std::size_t n = 0; n < size; ++n) {
    bits |= static_cast<std::uint64_t>(frame.data[first + n]) << (8 * n);
  }
  const std::size_t unused = 64 - 8 * size;
  return static_cast<std::int64_t>(bits << unused) >> unused;
}
inline double angle_deg(const protocol::Frame& frame) {  // of kReadAngle
  return static_cast<double>(read_signed(frame, 1, 7)) / 100;
}
inline double speed_dps(const protocol::Frame& frame) {  // of kReadState2 and motion
  return static_cast<double>(read_signed(frame, 4, 2));
}
inline double voltage_V(const protocol::Frame& frame) {  // of kReadState1
  return static_cast<double>(frame.data[3] + 256 * frame.data[4]) / 10;
}

inline bool is_reply(const protocol::Frame& frame) {
  return frame.id == 0x141 && frame.kind == protocol::FrameKind::kData && frame.dlc == 8;
}

inline double setting(const std::map<std::string, double>& host, const std::string& name,
                      double fallback) {
  const auto found = host.find(name);
  return found == host.end() ? fallback : found->second;
}
inline SimTime ms(double time_ms) {
  return SimTime{static_cast<SimTime::rep>(std::llround(time_ms * 1e6))};
}
inline double in_s(SimTime time) { return std::chrono::duration<double>(time).count(); }

}  // namespace lk::emulator::planted
