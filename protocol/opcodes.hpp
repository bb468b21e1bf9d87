#pragma once

/// @file The tables of commands: what is not in here gets no reply.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string_view>

namespace lk::protocol {

/// Identifier of a drive's queries is kSingleDriveId + ID, ID 1..32; that of its replies too, as
/// far as real drives go (Dialect::reply_id_base).
inline constexpr std::uint32_t kSingleDriveId = 0x140;
/// Identifiers of the commands for the drives 1..4 at once.
inline constexpr std::uint32_t kMultiDriveId = 0x280;
inline constexpr std::uint32_t kMultiSpeedId = 0x281;
inline constexpr std::uint32_t kMultiPositionId = 0x282;
inline constexpr std::uint32_t kMultiCommandId = 0x288;
inline constexpr int kMinId = 1;
inline constexpr int kMaxId = 32;
inline constexpr int kMaxDrivesPerBus = kMaxId - kMinId + 1;
inline constexpr int kMultiDriveSlots = 4;
/// In a slot of kMultiCommandId: nothing for this drive.
inline constexpr std::uint8_t kNoCommand = 0x00;

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
  kBrake = 0x8C,
  kReadEncoder = 0x90,
  kWriteOffsetToRom = 0x91,
  kReadMultiTurnAngle = 0x92,
  kReadSingleTurnAngle = 0x94,
  kClearAngle = 0x95,
  kReadState1 = 0x9A,
  kClearErrors = 0x9B,
  kReadState2 = 0x9C,
  kReadState3 = 0x9D,
  kOpenLoop = 0xA0,
  kTorque = 0xA1,
  kSpeed = 0xA2,
  kPosition1 = 0xA3,
  kPosition2 = 0xA4,
  kPosition3 = 0xA5,
  kPosition4 = 0xA6,
  kPosition5 = 0xA7,
  kPosition6 = 0xA8,
  kReadParameter = 0xC0,
  kWriteParameter = 0xC1,
};

/// Generations of firmware, as a set. What a drive answers follows from the switches of its
/// Dialect; the columns below say what the presets make of them, and a test holds the two together.
using Generations = std::uint8_t;
inline constexpr Generations kLegacy = 1U << 0U;
inline constexpr Generations kLateLegacy = 1U << 1U;
inline constexpr Generations kV235 = 1U << 2U;
inline constexpr Generations kV236 = 1U << 3U;
inline constexpr Generations kOlder = kLegacy | kLateLegacy;
inline constexpr Generations kNewer = kV235 | kV236;
inline constexpr Generations kAll = kOlder | kNewer;

/// Which series know a command. MS drives set voltages and have no current sensors.
enum class Fits : std::uint8_t { kAllSeries, kMsOnly, kAllButMs };

/// Where the knowledge of a command comes from.
enum class Source : std::uint8_t {
  kManual,             // the vendor's CAN manual
  kManualAndHardware,  // the manual, and its effect confirmed on real drives
  kHardware,           // the manual prints another DATA[0]; real drives use this one
  kNewerManuals,       // V2.35 and V2.36
};

struct OpcodeRow {
  Opcode opcode;
  std::string_view name;
  Generations generations;
  Fits fits;
  Source source;
};

// clang-format off
inline constexpr std::array kOpcodes = std::to_array<OpcodeRow>({
    {Opcode::kWriteZeroToRom, "write present position to ROM as zero", kAll, Fits::kAllSeries, Source::kManualAndHardware},
    {Opcode::kReadPid, "read PID", kOlder, Fits::kAllSeries, Source::kManual},
    {Opcode::kWritePidToRam, "write PID to RAM", kOlder, Fits::kAllSeries, Source::kManual},
    {Opcode::kWritePidToRom, "write PID to ROM", kOlder, Fits::kAllSeries, Source::kManual},
    {Opcode::kReadAcceleration, "read acceleration", kOlder, Fits::kAllSeries, Source::kManual},
    {Opcode::kWriteAccelerationToRam, "write acceleration to RAM", kOlder, Fits::kAllSeries, Source::kManual},
    {Opcode::kOff, "off", kAll, Fits::kAllSeries, Source::kManualAndHardware},
    {Opcode::kStop, "stop", kAll, Fits::kAllSeries, Source::kManual},
    {Opcode::kRun, "run", kAll, Fits::kAllSeries, Source::kManualAndHardware},
    {Opcode::kBrake, "brake", kV236, Fits::kAllSeries, Source::kNewerManuals},
    {Opcode::kReadEncoder, "read encoder", kAll, Fits::kAllSeries, Source::kManual},
    {Opcode::kWriteOffsetToRom, "write encoder offset to ROM", kOlder | kV235, Fits::kAllSeries, Source::kManual},
    {Opcode::kReadMultiTurnAngle, "read multi-turn angle", kAll, Fits::kAllSeries, Source::kManual},
    {Opcode::kReadSingleTurnAngle, "read single-turn angle", kAll, Fits::kAllSeries, Source::kManual},
    {Opcode::kClearAngle, "clear angle", kAll, Fits::kAllSeries, Source::kManualAndHardware},
    {Opcode::kReadState1, "read state 1", kAll, Fits::kAllSeries, Source::kManualAndHardware},
    {Opcode::kClearErrors, "clear errors", kAll, Fits::kAllSeries, Source::kHardware},
    {Opcode::kReadState2, "read state 2", kAll, Fits::kAllSeries, Source::kManual},
    {Opcode::kReadState3, "read state 3", kAll, Fits::kAllButMs, Source::kManual},
    {Opcode::kOpenLoop, "open-loop power", kNewer, Fits::kMsOnly, Source::kNewerManuals},
    {Opcode::kTorque, "torque", kAll, Fits::kAllButMs, Source::kManual},
    {Opcode::kSpeed, "speed", kAll, Fits::kAllSeries, Source::kManual},
    {Opcode::kPosition1, "position 1, multi-turn", kAll, Fits::kAllSeries, Source::kManual},
    {Opcode::kPosition2, "position 2, multi-turn, max speed", kAll, Fits::kAllSeries, Source::kManual},
    {Opcode::kPosition3, "position 3, single-turn", kAll, Fits::kAllSeries, Source::kHardware},
    {Opcode::kPosition4, "position 4, single-turn, max speed", kAll, Fits::kAllSeries, Source::kManual},
    {Opcode::kPosition5, "position 5, increment", kAll, Fits::kAllSeries, Source::kHardware},
    {Opcode::kPosition6, "position 6, increment, max speed", kAll, Fits::kAllSeries, Source::kHardware},
    {Opcode::kReadParameter, "read parameter", kV236, Fits::kAllSeries, Source::kNewerManuals},
    {Opcode::kWriteParameter, "write parameter to RAM", kV236, Fits::kAllSeries, Source::kNewerManuals},
});
// clang-format on

static_assert(std::ranges::adjacent_find(kOpcodes, std::ranges::greater_equal{},
                                         &OpcodeRow::opcode) == kOpcodes.end(),
              "command bytes ascend, so each stands once");

/// A command for the drives 1..4 at once is told by its identifier.
struct MultiDriveRow {
  std::uint32_t id;
  std::string_view name;
  Generations generations;
  Fits fits;
  Source source;
};

inline constexpr std::array kMultiDriveRows = std::to_array<MultiDriveRow>({
    {kMultiDriveId, "torque", kAll, Fits::kAllButMs, Source::kManual},
    {kMultiSpeedId, "speed", kV236, Fits::kAllSeries, Source::kNewerManuals},
    {kMultiPositionId, "position, multi-turn", kV236, Fits::kAllSeries, Source::kNewerManuals},
    {kMultiCommandId, "any single command", kV236, Fits::kAllSeries, Source::kNewerManuals},
});
static_assert(std::ranges::adjacent_find(kMultiDriveRows, std::ranges::greater_equal{},
                                         &MultiDriveRow::id) == kMultiDriveRows.end(),
              "identifiers ascend, so each stands once");

/// The row of an identifier; null when it is not one for several drives.
constexpr const MultiDriveRow* find_multi_drive(std::uint32_t id) {
  const auto row = std::ranges::lower_bound(kMultiDriveRows, id, {}, &MultiDriveRow::id);
  return row != kMultiDriveRows.end() && row->id == id ? &*row : nullptr;
}

/// The row of a command byte; null when no drive knows it.
constexpr const OpcodeRow* find_opcode(std::uint8_t byte) {
  const auto row =
      std::ranges::lower_bound(kOpcodes, static_cast<Opcode>(byte), {}, &OpcodeRow::opcode);
  return row != kOpcodes.end() && row->opcode == static_cast<Opcode>(byte) ? &*row : nullptr;
}

}  // namespace lk::protocol
