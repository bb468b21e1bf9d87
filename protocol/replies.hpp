#pragma once

/// @file What a drive answers. Drawn above each struct: DATA[0]..DATA[7] of the reply.

#include <cstdint>
#include <variant>

#include "protocol/commands.hpp"
#include "protocol/opcodes.hpp"
#include "protocol/wire.hpp"

namespace lk::protocol {

/// Replies to 0x31, 0x32, 0x34, 0x80, 0x81, 0x88, 0x91, 0x95 and 0xC1: the query as received,
/// unused bytes included.
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

// | 8C | coil | 0 | 0 | 0 | 0 | 0 | 0 |   0 = unpowered, the brake holds; 1 = powered, released
struct BrakeState {
  bool coil_powered = false;
  friend bool operator==(const BrakeState&, const BrakeState&) = default;
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
// | 94 | 0 | 0 | 0 | angle uint32, 0.01° |   where it is wide
struct SingleTurnAngle {
  std::uint32_t angle_cdeg = 0;
  friend bool operator==(const SingleTurnAngle&, const SingleTurnAngle&) = default;
};

// | 9A or 9B | temperature int8, °C | 0 | voltage uint16, 0.1 V | 0 | 0 | errorState |
// | 9A or 9B | temperature int8, °C | voltage uint16, 0.01 V | 0 | 0 | 0 | errorState |
// | 9A or 9B | temperature int8, °C | voltage uint16, 0.01 V | bus current int16, 0.01 A | 00 on,
// 10 off | errorState |
struct State1 {
  Opcode command = Opcode::kReadState1;  // DATA[0]: kReadState1 or kClearErrors
  double temperature_C = 0;
  double voltage_V = 0;
  std::uint8_t errors = 0;
  double bus_current_A = 0;  // of the third layout only
  bool bridge_on = true;     // of the third layout only
  friend bool operator==(const State1&, const State1&) = default;
};

// | 9C or A0..A8 | temperature int8, °C | iq int16, ±2048 | speed int16, dps | encoder uint16 |
// | 9C or A0..A8 | temperature int8, °C | power int16, ±1000 per mille | speed int16, dps | encoder
// uint16 |   on MS
struct State2 {
  Opcode command = Opcode::kReadState2;  // DATA[0]: kReadState2 or kOpenLoop..kPosition6
  double temperature_C = 0;
  double iq_A = 0;
  double speed_dps = 0;
  std::uint16_t encoder_counts = 0;
  double power = 0;  // −1..1 of the largest voltage; MS only, which have no iq
  friend bool operator==(const State2&, const State2&) = default;
};

// | 9D | temperature int8, °C | iA int16 | iB int16 | iC int16 |
struct State3 {
  double temperature_C = 0;
  double i_a_A = 0, i_b_A = 0, i_c_A = 0;
  friend bool operator==(const State3&, const State3&) = default;
};

// | C0 | id | value, see Parameter |
struct ParameterValue {
  Parameter parameter;
  friend bool operator==(const ParameterValue&, const ParameterValue&) = default;
};

using Reply = std::variant<Echo, ZeroWritten, Pid, Acceleration, BrakeState, Encoder,
                           MultiTurnAngle, SingleTurnAngle, State1, State2, State3, ParameterValue>;

}  // namespace lk::protocol
