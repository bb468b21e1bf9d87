#pragma once

/// @file What a host can ask of a drive. Drawn above each struct: DATA[0]..DATA[7] of the query;
/// "–" is a byte the drive ignores, which hosts leave full of rubbish.
///
/// Angles, counts, gains and the limits in whole dps stay the integers of the wire: their LSB is
/// the same for all drives, the drive computes with them, and 0.01° has no exact binary fraction.
/// Quantities whose LSB depends on the drive (A), or which only loops use (dps), are doubles.

#include <array>
#include <cstdint>
#include <variant>

#include "protocol/opcodes.hpp"

namespace lk::protocol {

/// Gains of the three loops, 0..255, dimensionless.
struct PidGains {
  std::uint8_t angle_kp = 0, angle_ki = 0;
  std::uint8_t speed_kp = 0, speed_ki = 0;
  std::uint8_t iq_kp = 0, iq_ki = 0;
  friend bool operator==(const PidGains&, const PidGains&) = default;
};

// | 19 | – | – | – | – | – | – | – |
struct WriteZeroToRom {
  friend bool operator==(const WriteZeroToRom&, const WriteZeroToRom&) = default;
};

// | 30 | – | – | – | – | – | – | – |
struct ReadPid {
  friend bool operator==(const ReadPid&, const ReadPid&) = default;
};

// | 31 | – | angle Kp | angle Ki | speed Kp | speed Ki | iq Kp | iq Ki |
struct WritePidToRam {
  PidGains gains;
  friend bool operator==(const WritePidToRam&, const WritePidToRam&) = default;
};

// | 32 | – | angle Kp | angle Ki | speed Kp | speed Ki | iq Kp | iq Ki |
struct WritePidToRom {
  PidGains gains;
  friend bool operator==(const WritePidToRom&, const WritePidToRom&) = default;
};

// | 33 | – | – | – | – | – | – | – |
struct ReadAcceleration {
  friend bool operator==(const ReadAcceleration&, const ReadAcceleration&) = default;
};

// | 34 | – | – | – | acceleration int32, 1 dps/s |
struct WriteAccelerationToRam {
  std::int32_t acceleration_dps_s = 0;
  friend bool operator==(const WriteAccelerationToRam&, const WriteAccelerationToRam&) = default;
};

// | 80 | – | – | – | – | – | – | – |
struct Off {
  friend bool operator==(const Off&, const Off&) = default;
};

// | 81 | – | – | – | – | – | – | – |
struct Stop {
  friend bool operator==(const Stop&, const Stop&) = default;
};

// | 88 | – | – | – | – | – | – | – |
struct Run {
  friend bool operator==(const Run&, const Run&) = default;
};

// What 0x8C asks for. The drive judges the byte, so it comes through as sent.
inline constexpr std::uint8_t kBrakeEngage = 0x00;
inline constexpr std::uint8_t kBrakeRelease = 0x01;
inline constexpr std::uint8_t kBrakeRead = 0x10;

// | 8C | action | – | – | – | – | – | – |
struct Brake {
  std::uint8_t action = kBrakeRead;
  friend bool operator==(const Brake&, const Brake&) = default;
};

// | 90 | – | – | – | – | – | – | – |
struct ReadEncoder {
  friend bool operator==(const ReadEncoder&, const ReadEncoder&) = default;
};

// | 91 | – | – | – | – | – | offset uint16, counts |
struct WriteOffsetToRom {
  std::uint16_t offset_counts = 0;
  friend bool operator==(const WriteOffsetToRom&, const WriteOffsetToRom&) = default;
};

// | 92 | – | – | – | – | – | – | – |
struct ReadMultiTurnAngle {
  friend bool operator==(const ReadMultiTurnAngle&, const ReadMultiTurnAngle&) = default;
};

// | 94 | – | – | – | – | – | – | – |
struct ReadSingleTurnAngle {
  friend bool operator==(const ReadSingleTurnAngle&, const ReadSingleTurnAngle&) = default;
};

// | 95 | – | – | – | – | – | – | – |
// | 95 | – | – | – | multi-turn angle int32, 0.01° |   where 0x95 sets the angle
struct ClearAngle {
  std::int32_t angle_cdeg = 0;
  friend bool operator==(const ClearAngle&, const ClearAngle&) = default;
};

// | 9A | – | – | – | – | – | – | – |
struct ReadState1 {
  friend bool operator==(const ReadState1&, const ReadState1&) = default;
};

// | 9B | – | – | – | – | – | – | – |
struct ClearErrors {
  friend bool operator==(const ClearErrors&, const ClearErrors&) = default;
};

// | 9C | – | – | – | – | – | – | – |
struct ReadState2 {
  friend bool operator==(const ReadState2&, const ReadState2&) = default;
};

// | 9D | – | – | – | – | – | – | – |
struct ReadState3 {
  friend bool operator==(const ReadState3&, const ReadState3&) = default;
};

// | A0 | – | – | – | power int16, per mille of the largest voltage, ±850 | – | – |
struct OpenLoop {
  std::int16_t power_permille = 0;
  friend bool operator==(const OpenLoop&, const OpenLoop&) = default;
};

// | A1 | – | – | – | iq int16, ±2000 of 16 mA; ±2048 where the series sets the scale | – | – |
struct Torque {
  double iq_A = 0;
  friend bool operator==(const Torque&, const Torque&) = default;
};

// | A2 | – | – | – | speed int32, 0.01 dps |
// | A2 | – | iq limit int16, as A1 | speed int32, 0.01 dps |   where 0xA2 has a limit
struct Speed {
  double speed_dps = 0;
  double iq_limit_A = 0;  // >= 0; 0 = no limit beyond the setting
  friend bool operator==(const Speed&, const Speed&) = default;
};

// | A3 | – | – | – | multi-turn angle int32, 0.01° |
struct Position1 {
  std::int32_t target_cdeg = 0;
  friend bool operator==(const Position1&, const Position1&) = default;
};

// | A4 | – | max speed uint16, 1 dps | multi-turn angle int32, 0.01° |
struct Position2 {
  std::uint16_t max_speed_dps = 0;  // 0 = no limit beyond the setting
  std::int32_t target_cdeg = 0;
  friend bool operator==(const Position2&, const Position2&) = default;
};

// The direction of travel to a single-turn target. The drive judges the byte, so it comes through
// as sent.
inline constexpr std::uint8_t kClockwise = 0;
inline constexpr std::uint8_t kCounterClockwise = 1;
/// One turn in 0.01°; single-turn targets lie below, unless the turn is that of an output.
inline constexpr std::uint16_t kTurn_cdeg = 36000;

// | A5 | direction | – | – | single-turn angle uint16, 0.01° | – | – |
// | A5 | direction | – | – | single-turn angle uint32, 0.01° |   where targets are wide
struct Position3 {
  std::uint8_t direction = kClockwise;
  std::uint32_t target_cdeg = 0;  // valid: what 0x94 can read
  friend bool operator==(const Position3&, const Position3&) = default;
};

// | A6 | direction | max speed uint16, 1 dps | single-turn angle uint16, 0.01° | – | – |
// | A6 | direction | max speed uint16, 1 dps | single-turn angle uint32, 0.01° |   where targets
// are wide
struct Position4 {
  std::uint8_t direction = kClockwise;
  std::uint16_t max_speed_dps = 0;  // 0 = no limit beyond the setting
  std::uint32_t target_cdeg = 0;    // valid: what 0x94 can read
  friend bool operator==(const Position4&, const Position4&) = default;
};

// | A7 | – | – | – | increment int32, 0.01°, its sign is the direction |
struct Position5 {
  std::int32_t increment_cdeg = 0;
  friend bool operator==(const Position5&, const Position5&) = default;
};

// | A8 | – | max speed uint16, 1 dps | increment int32, 0.01° |
struct Position6 {
  std::uint16_t max_speed_dps = 0;  // 0 = no limit beyond the setting
  std::int32_t increment_cdeg = 0;
  friend bool operator==(const Position6&, const Position6&) = default;
};

/// What 0xC0 and 0xC1 can name.
enum class ParameterId : std::uint8_t {
  kAngleGains = 0x0A,
  kSpeedGains = 0x0B,
  kCurrentGains = 0x0C,
  kMaxTorqueCurrent = 0x1E,  // Max Power on MS
  kMaxSpeed = 0x20,
  kMaxAngle = 0x22,
  kCurrentRamp = 0x24,
  kSpeedRamp = 0x26,
};
inline constexpr std::array kParameterIds{
    ParameterId::kAngleGains,       ParameterId::kSpeedGains, ParameterId::kCurrentGains,
    ParameterId::kMaxTorqueCurrent, ParameterId::kMaxSpeed,   ParameterId::kMaxAngle,
    ParameterId::kCurrentRamp,      ParameterId::kSpeedRamp};

/// The gains of one loop; 16 bits on the scale of the bytes of 0x30.
struct LoopGains {
  std::uint16_t kp = 0, ki = 0, kd = 0;
  friend bool operator==(const LoopGains&, const LoopGains&) = default;
};

// DATA[1..7] of 0xC1 and of the reply to 0xC0:
// | .. | 0A 0B 0C | Kp uint16 | Ki uint16 | Kd uint16 |
// | .. | 1E | – | – | max torque current int16, as A1; MS: max power int16, per mille | – | – |
// | .. | 20 | – | – | max speed int32, 0.01 dps |
// | .. | 22 | – | – | max angle int32, 0.01° |
// | .. | 24 | – | – | current ramp int32, 1 mA/s |
// | .. | 26 | – | – | speed ramp int32, 1 dps/s |
struct Parameter {
  ParameterId id = ParameterId::kAngleGains;
  LoopGains gains;          // 0x0A, 0x0B, 0x0C
  std::int32_t number = 0;  // the others
  friend bool operator==(const Parameter&, const Parameter&) = default;
};

// | C0 | id | – | – | – | – | – | – |
struct ReadParameter {
  ParameterId id = ParameterId::kAngleGains;
  friend bool operator==(const ReadParameter&, const ReadParameter&) = default;
};

// | C1 | id | value, see Parameter |
struct WriteParameter {
  Parameter parameter;
  friend bool operator==(const WriteParameter&, const WriteParameter&) = default;
};

// Identifier 0x280: | iq of ID 1, int16 | iq of ID 2 | iq of ID 3 | iq of ID 4 |
struct MultiTorque {
  std::array<double, kMultiDriveSlots> iq_A{};
  friend bool operator==(const MultiTorque&, const MultiTorque&) = default;
};

// Identifier 0x281: | speed of ID 1, int16, 1 dps | of ID 2 | of ID 3 | of ID 4 |
struct MultiSpeed {
  std::array<std::int16_t, kMultiDriveSlots> speed_dps{};
  friend bool operator==(const MultiSpeed&, const MultiSpeed&) = default;
};

// Identifier 0x282: | multi-turn angle of ID 1, int16, 1° | of ID 2 | of ID 3 | of ID 4 |
struct MultiPosition {
  std::array<std::int16_t, kMultiDriveSlots> target_deg{};
  friend bool operator==(const MultiPosition&, const MultiPosition&) = default;
};

// Identifier 0x288: | command byte for ID 1 | – | for ID 2 | – | for ID 3 | – | for ID 4 | – |
struct MultiCommand {
  std::array<std::uint8_t, kMultiDriveSlots> opcodes{};
  friend bool operator==(const MultiCommand&, const MultiCommand&) = default;
};

/// One alternative for each row of kOpcodes, then one for each of kMultiDriveRows.
using Command =
    std::variant<WriteZeroToRom, ReadPid, WritePidToRam, WritePidToRom, ReadAcceleration,
                 WriteAccelerationToRam, Off, Stop, Run, Brake, ReadEncoder, WriteOffsetToRom,
                 ReadMultiTurnAngle, ReadSingleTurnAngle, ClearAngle, ReadState1, ClearErrors,
                 ReadState2, ReadState3, OpenLoop, Torque, Speed, Position1, Position2, Position3,
                 Position4, Position5, Position6, ReadParameter, WriteParameter, MultiTorque,
                 MultiSpeed, MultiPosition, MultiCommand>;
static_assert(std::variant_size_v<Command> == kOpcodes.size() + kMultiDriveRows.size());

}  // namespace lk::protocol
