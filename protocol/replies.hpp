#pragma once

/// @file What a drive answers. Drawn above each struct: DATA[0]..DATA[7] of the reply.

#include <cstdint>
#include <variant>

#include "protocol/commands.hpp"
#include "protocol/opcodes.hpp"
#include "protocol/wire.hpp"

namespace lk::protocol {

/// Replies to 0x31, 0x32, 0x34, 0x80, 0x81, 0x88, 0x91 and 0x95: the query as received, unused
/// bytes included.
struct Echo {
  Payload data{};
  friend bool operator==(const Echo&, const Echo&) = default;
};

// | 19 | 0 | 0 | 0 | 0 | 0 | new offset uint16, counts |
struct ZeroWritten {
  std::uint16_t offset_counts = 0;
  friend bool operator==(const ZeroWritten&, const ZeroWritten&) = default;
};

// | 30 | 0 | angle Kp | angle Ki | speed Kp | speed Ki | iq Kp | iq Ki |
struct Pid {
  PidGains gains;
  friend bool operator==(const Pid&, const Pid&) = default;
};

// | 33 | 0 | 0 | 0 | acceleration int32, 1 dps/s |
struct Acceleration {
  std::int32_t acceleration_dps_s = 0;
  friend bool operator==(const Acceleration&, const Acceleration&) = default;
};

// | 90 | 0 | encoder uint16, counts | raw uint16 | offset uint16 |   encoder = (raw − offset) mod
// turn
struct Encoder {
  std::uint16_t encoder_counts = 0;
  std::uint16_t raw_counts = 0;
  std::uint16_t offset_counts = 0;
  friend bool operator==(const Encoder&, const Encoder&) = default;
};

// | 92 | angle, signed 56-bit, 0.01°, clockwise positive |
struct MultiTurnAngle {
  std::int64_t angle_cdeg = 0;  // kInt56Min..kInt56Max, saturates
  friend bool operator==(const MultiTurnAngle&, const MultiTurnAngle&) = default;
};

// | 94 | 0 | 0 | 0 | 0 | 0 | angle uint16, 0.01°, 0..35999 |
struct SingleTurnAngle {
  std::uint16_t angle_cdeg = 0;
  friend bool operator==(const SingleTurnAngle&, const SingleTurnAngle&) = default;
};

// | 9A or 9B | temperature int8, °C | 0 | voltage uint16, 0.1 V | 0 | 0 | errorState |
struct State1 {
  Opcode command = Opcode::kReadState1;  // DATA[0]: kReadState1 or kClearErrors
  double temperature_C = 0;
  double voltage_V = 0;
  std::uint8_t errors = 0;
  friend bool operator==(const State1&, const State1&) = default;
};

// | 9C or A1..A8 | temperature int8, °C | iq int16, 33/2048 A, ±2048 | speed int16, dps | encoder
// uint16 |
struct State2 {
  Opcode command = Opcode::kReadState2;  // DATA[0]: kReadState2 or kTorque..kPosition6
  double temperature_C = 0;
  double iq_A = 0;
  double speed_dps = 0;
  std::uint16_t encoder_counts = 0;
  friend bool operator==(const State2&, const State2&) = default;
};

// | 9D | temperature int8, °C | iA int16, 1/64 A | iB int16 | iC int16 |
struct State3 {
  double temperature_C = 0;
  double i_a_A = 0, i_b_A = 0, i_c_A = 0;
  friend bool operator==(const State3&, const State3&) = default;
};

using Reply = std::variant<Echo, ZeroWritten, Pid, Acceleration, Encoder, MultiTurnAngle,
                           SingleTurnAngle, State1, State2, State3>;

}  // namespace lk::protocol
