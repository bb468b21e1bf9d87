#pragma once

/// @file Queries to one drive. Positions of their bytes: command_table.hpp.
///
/// Angles, counts and gains are the integers on the wire: drives compute with integers, and 0.01°
/// has no exact binary fraction. Speeds are doubles, and quantities whose LSB depends on the drive
/// or the wire.

#include <array>
#include <cstdint>

#include "protocol/opcodes.hpp"
#include "protocol/parameters.hpp"

namespace lk::protocol {

/// Restarts the drive, without a reply.
struct Restart : NoFields<0x07> {};

/// Turns the shaft back and forth to measure the angle between encoder and windings.
struct Calibrate : NoFields<0x18> {};
struct WriteZeroToRom : NoFields<0x19> {};
struct ReadPid : NoFields<0x30> {};

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

struct ReadAcceleration : NoFields<0x33> {};

struct WriteAccelerationToRam {
  static constexpr Opcode kOpcode{0x34};
  std::int32_t acceleration_dps_s = 0;
  bool operator==(const WriteAccelerationToRam&) const = default;
};

struct ReadMaxTorque : NoFields<0x37> {};

struct WriteMaxTorque {
  static constexpr Opcode kOpcode{0x38};
  std::int32_t max_torque_lsb = 0;  // in LSB of the iq command; on MS per mille of the power
  bool operator==(const WriteMaxTorque&) const = default;
};

// Settings on CAN; those of RS-485 are in serial_commands.hpp.

struct ReadStoredSetting {
  static constexpr Opcode kOpcode{0x40};
  StoredSetting setting;  // `gains` and `number` are unused
  bool operator==(const ReadStoredSetting&) const = default;
};

struct WriteStoredSetting {
  static constexpr Opcode kOpcode{0x42};
  StoredSetting setting;
  bool operator==(const WriteStoredSetting&) const = default;
};

// Drives execute 0x44 only if DATA[2] has this value.
inline constexpr std::uint8_t kSaveItem = 0xFA;

struct SaveSettings {
  static constexpr Opcode kOpcode{0x44};
  std::uint8_t table = kNamedSettings;
  std::uint8_t item = kSaveItem;
  bool operator==(const SaveSettings&) const = default;
};

struct Off : NoFields<0x80> {};
struct Stop : NoFields<0x81> {};
struct Run : NoFields<0x88> {};

// Actions of 0x8C. The decoder accepts any byte, because the drive checks it.
inline constexpr std::uint8_t kBrakeEngage = 0x00;
inline constexpr std::uint8_t kBrakeRelease = 0x01;
inline constexpr std::uint8_t kBrakeRead = 0x10;

struct Brake {
  static constexpr Opcode kOpcode{0x8C};
  std::uint8_t action = kBrakeRead;
  bool operator==(const Brake&) const = default;
};

// Values of the type in 0x90, for drives on RS-485 whose 0x90 has a type.
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

struct ReadMultiTurnAngle : NoFields<0x92> {};
struct ReadSingleTurnAngle : NoFields<0x94> {};

struct ClearAngle {
  static constexpr Opcode kOpcode{0x95};
  std::int32_t angle_cdeg = 0;
  bool operator==(const ClearAngle&) const = default;
};

struct ReadState1 : NoFields<0x9A> {};
struct ClearErrors : NoFields<0x9B> {};
struct ReadState2 : NoFields<0x9C> {};
struct ReadState3 : NoFields<0x9D> {};

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

// Direction to a single-turn target. The decoder accepts any byte, because the drive checks it.
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
