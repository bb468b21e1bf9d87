#pragma once

/// @file Queries to one drive. Positions of their bytes: command_table.hpp.
///
/// Angles, counts and gains stay integers of the wire: drives compute with them, and 0.01° has no
/// exact binary fraction. Quantities whose LSB depends on drive or wire, or in dps, are doubles.

#include <array>
#include <cstdint>

#include "protocol/opcodes.hpp"
#include "protocol/parameters.hpp"

namespace lk::protocol {

/// Restarts the drive, without a reply.
struct Restart {
  static constexpr Opcode kOpcode{0x07};
  bool operator==(const Restart&) const = default;
};

/// Turns the shaft back and forth to measure the angle between encoder and windings.
struct Calibrate {
  static constexpr Opcode kOpcode{0x18};
  bool operator==(const Calibrate&) const = default;
};

struct WriteZeroToRom {
  static constexpr Opcode kOpcode{0x19};
  bool operator==(const WriteZeroToRom&) const = default;
};

struct ReadPid {
  static constexpr Opcode kOpcode{0x30};
  bool operator==(const ReadPid&) const = default;
};

struct WritePidToRam {
  static constexpr Opcode kOpcode{0x31};
  PidGains gains;
  bool operator==(const WritePidToRam&) const = default;
};

struct WritePidToRom {
  static constexpr Opcode kOpcode{0x32};
  PidGains gains;
  bool operator==(const WritePidToRom&) const = default;
};

struct ReadAcceleration {
  static constexpr Opcode kOpcode{0x33};
  bool operator==(const ReadAcceleration&) const = default;
};

struct WriteAccelerationToRam {
  static constexpr Opcode kOpcode{0x34};
  std::int32_t acceleration_dps_s = 0;
  bool operator==(const WriteAccelerationToRam&) const = default;
};

struct ReadMaxTorque {
  static constexpr Opcode kOpcode{0x37};
  bool operator==(const ReadMaxTorque&) const = default;
};

struct WriteMaxTorque {
  static constexpr Opcode kOpcode{0x38};
  std::int32_t max_torque_lsb = 0;  // LSB of the iq command; per mille of the power on MS
  bool operator==(const WriteMaxTorque&) const = default;
};

// Settings on CAN; those of RS-485 are in serial_commands.hpp.

struct ReadStoredSetting {
  static constexpr Opcode kOpcode{0x40};
  StoredSetting setting;  // its value is unused
  bool operator==(const ReadStoredSetting&) const = default;
};

struct WriteStoredSetting {
  static constexpr Opcode kOpcode{0x42};
  StoredSetting setting;
  bool operator==(const WriteStoredSetting&) const = default;
};

// DATA[2] that 0x44 needs to be executed.
inline constexpr std::uint8_t kSaveItem = 0xFA;

struct SaveSettings {
  static constexpr Opcode kOpcode{0x44};
  std::uint8_t table = kNamedSettings;
  std::uint8_t item = kSaveItem;
  bool operator==(const SaveSettings&) const = default;
};

struct Off {
  static constexpr Opcode kOpcode{0x80};
  bool operator==(const Off&) const = default;
};

struct Stop {
  static constexpr Opcode kOpcode{0x81};
  bool operator==(const Stop&) const = default;
};

struct Run {
  static constexpr Opcode kOpcode{0x88};
  bool operator==(const Run&) const = default;
};

// Actions of 0x8C. The decoder passes the byte on, because the drive checks it.
inline constexpr std::uint8_t kBrakeEngage = 0x00;
inline constexpr std::uint8_t kBrakeRelease = 0x01;
inline constexpr std::uint8_t kBrakeRead = 0x10;

struct Brake {
  static constexpr Opcode kOpcode{0x8C};
  std::uint8_t action = kBrakeRead;
  bool operator==(const Brake&) const = default;
};

// Types of 0x90, if it has a type (RS-485).
inline constexpr std::uint8_t kEncoderZeroed = 0;
inline constexpr std::uint8_t kEncoderRaw = 1;

struct ReadEncoder {
  static constexpr Opcode kOpcode{0x90};
  std::uint8_t type = kEncoderZeroed;
  bool operator==(const ReadEncoder&) const = default;
};

struct WriteOffsetToRom {
  static constexpr Opcode kOpcode{0x91};
  std::uint16_t offset_counts = 0;
  bool operator==(const WriteOffsetToRom&) const = default;
};

struct ReadMultiTurnAngle {
  static constexpr Opcode kOpcode{0x92};
  bool operator==(const ReadMultiTurnAngle&) const = default;
};

struct ReadSingleTurnAngle {
  static constexpr Opcode kOpcode{0x94};
  bool operator==(const ReadSingleTurnAngle&) const = default;
};

struct ClearAngle {
  static constexpr Opcode kOpcode{0x95};
  std::int32_t angle_cdeg = 0;
  bool operator==(const ClearAngle&) const = default;
};

struct ReadState1 {
  static constexpr Opcode kOpcode{0x9A};
  bool operator==(const ReadState1&) const = default;
};

struct ClearErrors {
  static constexpr Opcode kOpcode{0x9B};
  bool operator==(const ClearErrors&) const = default;
};

struct ReadState2 {
  static constexpr Opcode kOpcode{0x9C};
  bool operator==(const ReadState2&) const = default;
};

struct ReadState3 {
  static constexpr Opcode kOpcode{0x9D};
  bool operator==(const ReadState3&) const = default;
};

struct OpenLoop {
  static constexpr Opcode kOpcode{0xA0};
  std::int16_t power_permille = 0;
  bool operator==(const OpenLoop&) const = default;
};

struct Torque {
  static constexpr Opcode kOpcode{0xA1};
  double iq_A = 0;
  bool operator==(const Torque&) const = default;
};

struct Speed {
  static constexpr Opcode kOpcode{0xA2};
  double speed_dps = 0;
  double iq_limit_A = 0;  // >= 0; 0 = no limit beyond the setting
  bool operator==(const Speed&) const = default;
};

struct Position1 {
  static constexpr Opcode kOpcode{0xA3};
  std::int64_t target_cdeg = 0;
  bool operator==(const Position1&) const = default;
};

struct Position2 {
  static constexpr Opcode kOpcode{0xA4};
  double max_speed_dps = 0;  // 0 = no limit beyond the setting
  std::int64_t target_cdeg = 0;
  bool operator==(const Position2&) const = default;
};

// Direction to a single-turn target. The decoder passes the byte on, because the drive checks it.
inline constexpr std::uint8_t kClockwise = 0;
inline constexpr std::uint8_t kCounterClockwise = 1;

struct Position3 {
  static constexpr Opcode kOpcode{0xA5};
  std::uint8_t direction = kClockwise;
  std::uint32_t target_cdeg = 0;  // valid range: that of 0x94
  bool operator==(const Position3&) const = default;
};

struct Position4 {
  static constexpr Opcode kOpcode{0xA6};
  std::uint8_t direction = kClockwise;
  double max_speed_dps = 0;       // 0 = no limit beyond the setting
  std::uint32_t target_cdeg = 0;  // valid range: that of 0x94
  bool operator==(const Position4&) const = default;
};

struct Position5 {
  static constexpr Opcode kOpcode{0xA7};
  std::int32_t increment_cdeg = 0;
  bool operator==(const Position5&) const = default;
};

struct Position6 {
  static constexpr Opcode kOpcode{0xA8};
  double max_speed_dps = 0;  // 0 = no limit beyond the setting
  std::int32_t increment_cdeg = 0;
  bool operator==(const Position6&) const = default;
};

struct ReadParameter {
  static constexpr Opcode kOpcode{0xC0};
  ParameterId id = ParameterId::kAngleGains;
  bool operator==(const ReadParameter&) const = default;
};

struct WriteParameter {
  static constexpr Opcode kOpcode{0xC1};
  Parameter parameter;
  bool operator==(const WriteParameter&) const = default;
};

}  // namespace lk::protocol
