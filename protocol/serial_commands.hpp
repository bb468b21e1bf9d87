#pragma once

/// @file Queries that only RS-485 has (docs/reference/rs485.md): settings, and queries of the
/// vendor's PC tool. serial_table.hpp has the positions of their bytes.

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
  kMaxAngleLow = 0x9B,  // low four bytes of an int64 in 0.01°; kMaxAngleHigh has the others
  kMaxAngleHigh = 0x9C,
  kCurrentRamp = 0x9D,
  kSpeedRamp = 0x9E,
};

struct Setting {
  SettingId id = SettingId::kAngleGains;
  LoopGains gains;          // value of 0x96, 0x97, 0x98
  std::int32_t number = 0;  // value of the other settings
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

struct Restore : NoFields<0x89> {};
struct ClearTurns : NoFields<0x93> {};
struct Connect : NoFields<0x10> {};
struct Disconnect : NoFields<0x11> {};
struct ReadProduct : NoFields<0x12> {};

// Sizes of the blocks of data that the PC tool reads and writes. For their contents see
// emulator/core/servo/tool_blocks.hpp. A write query carries the block in Query::data.
inline constexpr std::uint8_t kSettingsBytes = 104;
inline constexpr std::uint8_t kCalibrationBytes = 28;         // MS, MF, MH
inline constexpr std::uint8_t kGearedCalibrationBytes = 108;  // MG

struct ReadSettingsBlock : NoFields<0x14> {};
struct WriteSettingsBlock : NoFields<0x15> {};
struct ReadCalibration : NoFields<0x16> {};
struct WriteCalibration : NoFields<0x17> {};
struct ReadDeviceType : NoFields<0x1F> {};
struct AlignReducer : NoFields<0x20> {};
struct RestoreSettings : NoFields<0x48> {};
struct RestoreCalibration : NoFields<0x4A> {};

}  // namespace lk::protocol
