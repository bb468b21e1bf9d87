#pragma once

/// @file The table of command bytes. What is not in here gets no reply.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string_view>

namespace lk::protocol {

/// Identifier of a drive's queries and of its replies is kSingleDriveId + ID, ID 1..32.
inline constexpr std::uint32_t kSingleDriveId = 0x140;
/// Identifier of the torque command for the drives 1..4.
inline constexpr std::uint32_t kMultiDriveId = 0x280;
inline constexpr int kMinId = 1;
inline constexpr int kMaxId = 32;
inline constexpr int kMaxDrivesPerBus = kMaxId - kMinId + 1;
inline constexpr int kMultiDriveSlots = 4;

/// DATA[0] of a query to a single drive.
enum class Opcode : std::uint8_t {
  kWriteZeroToRom = 0x19,
  kReadPid = 0x30,
  kWritePidToRam = 0x31,
  kWritePidToRom = 0x32,
  kReadAcceleration = 0x33,
  kWriteAccelerationToRam = 0x34,
  kOff = 0x80,
  kStop = 0x81,
  kRun = 0x88,
  kReadEncoder = 0x90,
  kWriteOffsetToRom = 0x91,
  kReadMultiTurnAngle = 0x92,
  kReadSingleTurnAngle = 0x94,
  kClearAngle = 0x95,
  kReadState1 = 0x9A,
  kClearErrors = 0x9B,
  kReadState2 = 0x9C,
  kReadState3 = 0x9D,
  kTorque = 0xA1,
  kSpeed = 0xA2,
  kPosition1 = 0xA3,
  kPosition2 = 0xA4,
  kPosition3 = 0xA5,
  kPosition4 = 0xA6,
  kPosition5 = 0xA7,
  kPosition6 = 0xA8,
};

/// Generations of firmware, as a set.
using Generations = std::uint8_t;
inline constexpr Generations kLegacy = 1U << 0U;

/// Where the knowledge of a command comes from.
enum class Source : std::uint8_t {
  kManual,             // the vendor's CAN manual
  kManualAndHardware,  // the manual, and its effect confirmed on real drives
  kHardware,           // the manual prints another DATA[0]; real drives use this one
};

struct OpcodeRow {
  Opcode opcode;
  std::string_view name;
  Generations generations;
  Source source;
};

inline constexpr std::array kOpcodes = std::to_array<OpcodeRow>({
    {Opcode::kWriteZeroToRom, "write present position to ROM as zero", kLegacy,
     Source::kManualAndHardware},
    {Opcode::kReadPid, "read PID", kLegacy, Source::kManual},
    {Opcode::kWritePidToRam, "write PID to RAM", kLegacy, Source::kManual},
    {Opcode::kWritePidToRom, "write PID to ROM", kLegacy, Source::kManual},
    {Opcode::kReadAcceleration, "read acceleration", kLegacy, Source::kManual},
    {Opcode::kWriteAccelerationToRam, "write acceleration to RAM", kLegacy, Source::kManual},
    {Opcode::kOff, "off", kLegacy, Source::kManualAndHardware},
    {Opcode::kStop, "stop", kLegacy, Source::kManual},
    {Opcode::kRun, "run", kLegacy, Source::kManualAndHardware},
    {Opcode::kReadEncoder, "read encoder", kLegacy, Source::kManual},
    {Opcode::kWriteOffsetToRom, "write encoder offset to ROM", kLegacy, Source::kManual},
    {Opcode::kReadMultiTurnAngle, "read multi-turn angle", kLegacy, Source::kManual},
    {Opcode::kReadSingleTurnAngle, "read single-turn angle", kLegacy, Source::kManual},
    {Opcode::kClearAngle, "clear angle", kLegacy, Source::kManualAndHardware},
    {Opcode::kReadState1, "read state 1", kLegacy, Source::kManual},
    {Opcode::kClearErrors, "clear errors", kLegacy, Source::kHardware},
    {Opcode::kReadState2, "read state 2", kLegacy, Source::kManual},
    {Opcode::kReadState3, "read state 3", kLegacy, Source::kManual},
    {Opcode::kTorque, "torque", kLegacy, Source::kManual},
    {Opcode::kSpeed, "speed", kLegacy, Source::kManual},
    {Opcode::kPosition1, "position 1, multi-turn", kLegacy, Source::kManual},
    {Opcode::kPosition2, "position 2, multi-turn, max speed", kLegacy, Source::kManual},
    {Opcode::kPosition3, "position 3, single-turn", kLegacy, Source::kHardware},
    {Opcode::kPosition4, "position 4, single-turn, max speed", kLegacy, Source::kManual},
    {Opcode::kPosition5, "position 5, increment", kLegacy, Source::kHardware},
    {Opcode::kPosition6, "position 6, increment, max speed", kLegacy, Source::kHardware},
});

static_assert(std::ranges::adjacent_find(kOpcodes, std::ranges::greater_equal{},
                                         &OpcodeRow::opcode) == kOpcodes.end(),
              "command bytes ascend, so each stands once");

/// The row of a command byte; null when no drive knows it.
constexpr const OpcodeRow* find_opcode(std::uint8_t byte) {
  const auto row =
      std::ranges::lower_bound(kOpcodes, static_cast<Opcode>(byte), {}, &OpcodeRow::opcode);
  return row != kOpcodes.end() && row->opcode == static_cast<Opcode>(byte) ? &*row : nullptr;
}

}  // namespace lk::protocol
