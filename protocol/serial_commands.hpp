#pragma once

/// @file Queries on RS-485 only (docs/reference/rs485.md): settings, and queries of the vendor's PC
/// tool. Positions of their bytes: serial_table.hpp.

#include <cstdint>

#include "protocol/opcodes.hpp"
#include "protocol/parameters.hpp"

namespace lk::protocol {

/// Settings of 0x40, 0x42 and 0x44.
enum class SettingId : std::uint8_t {
  kAngleGains = 0x96,
  kSpeedGains = 0x97,
  kCurrentGains = 0x98,
  kMaxTorqueCurrent = 0x99,  // Max Power on MS
  kMaxSpeed = 0x9A,
  kMaxAngleLow = 0x9B,  // the low four bytes of an int64, 0.01°
  kMaxAngleHigh = 0x9C,
  kCurrentRamp = 0x9D,
  kSpeedRamp = 0x9E,
};

struct Setting {
  SettingId id = SettingId::kAngleGains;
  LoopGains gains;          // 0x96, 0x97, 0x98
  std::int32_t number = 0;  // the others
  bool operator==(const Setting&) const = default;
};

struct ReadSetting {
  static constexpr Opcode kOpcode{0x40};
  SettingId id = SettingId::kAngleGains;
  bool operator==(const ReadSetting&) const = default;
};

struct WriteSettingToRam {
  static constexpr Opcode kOpcode{0x42};
  Setting setting;
  bool operator==(const WriteSettingToRam&) const = default;
};

struct WriteSettingToRom {
  static constexpr Opcode kOpcode{0x44};
  Setting setting;
  bool operator==(const WriteSettingToRom&) const = default;
};

struct Restore {
  static constexpr Opcode kOpcode{0x89};
  bool operator==(const Restore&) const = default;
};

struct ClearTurns {
  static constexpr Opcode kOpcode{0x93};
  bool operator==(const ClearTurns&) const = default;
};

struct Connect {
  static constexpr Opcode kOpcode{0x10};
  bool operator==(const Connect&) const = default;
};

struct Disconnect {
  static constexpr Opcode kOpcode{0x11};
  bool operator==(const Disconnect&) const = default;
};

struct ReadProduct {
  static constexpr Opcode kOpcode{0x12};
  bool operator==(const ReadProduct&) const = default;
};

// Sizes of the tool's blocks; contents: emulator/core/servo/tool_blocks.hpp. A write query carries
// its block in Query::data.
inline constexpr std::uint8_t kSettingsBytes = 104;
inline constexpr std::uint8_t kCalibrationBytes = 28;         // MS, MF, MH
inline constexpr std::uint8_t kGearedCalibrationBytes = 108;  // MG

struct ReadSettingsBlock {
  static constexpr Opcode kOpcode{0x14};
  bool operator==(const ReadSettingsBlock&) const = default;
};

struct WriteSettingsBlock {
  static constexpr Opcode kOpcode{0x15};
  bool operator==(const WriteSettingsBlock&) const = default;
};

struct ReadCalibration {
  static constexpr Opcode kOpcode{0x16};
  bool operator==(const ReadCalibration&) const = default;
};

struct WriteCalibration {
  static constexpr Opcode kOpcode{0x17};
  bool operator==(const WriteCalibration&) const = default;
};

struct ReadDeviceType {
  static constexpr Opcode kOpcode{0x1F};
  bool operator==(const ReadDeviceType&) const = default;
};

struct AlignReducer {
  static constexpr Opcode kOpcode{0x20};
  bool operator==(const AlignReducer&) const = default;
};

struct RestoreSettings {
  static constexpr Opcode kOpcode{0x48};
  bool operator==(const RestoreSettings&) const = default;
};

struct RestoreCalibration {
  static constexpr Opcode kOpcode{0x4A};
  bool operator==(const RestoreCalibration&) const = default;
};

}  // namespace lk::protocol
