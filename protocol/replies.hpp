#pragma once

/// @file Replies of a drive. Positions of their bytes: command_table.hpp.

#include <cstdint>
#include <variant>

#include "protocol/commands.hpp"
#include "protocol/opcodes.hpp"
#include "protocol/serial_commands.hpp"
#include "protocol/wire.hpp"

namespace lk::protocol {

/// The query as received, unused bytes included.
struct Echo {
  Payload data{};
  std::uint8_t size = kCanBytes;  // bytes of `data`
  bool operator==(const Echo&) const = default;
};

struct ZeroWritten {
  std::uint32_t offset_counts = 0;
  std::uint8_t encoder = 0;  // only on RS-485: 0 is the encoder of the motor
  bool operator==(const ZeroWritten&) const = default;
};

/// The reply to 0x18; all 0 when the drive did not begin.
struct Calibrated {
  std::uint32_t align_value = 0;
  std::uint16_t align_ratio = 0;  // per mille of the commanded travel
  std::uint8_t status = 0;        // kCalibrationDone, kPhasesReversed
  bool operator==(const Calibrated&) const = default;
};
inline constexpr std::uint8_t kCalibrationDone = 0x01;
inline constexpr std::uint8_t kPhasesReversed = 0x10;

struct MaxTorque {
  std::int32_t max_torque_lsb = 0;
  bool operator==(const MaxTorque&) const = default;
};

/// Value of a setting, now or after the next start.
struct StoredSettingValue {
  StoredSetting setting;
  Opcode command = ReadStoredSetting::kOpcode;  // of the query
  bool operator==(const StoredSettingValue&) const = default;
};

struct SettingsSaved {
  std::uint8_t table = kNamedSettings;
  bool saved = false;
  bool operator==(const SettingsSaved&) const = default;
};

struct Pid {
  PidGains gains;
  bool operator==(const Pid&) const = default;
};

struct Acceleration {
  std::int32_t acceleration_dps_s = 0;
  bool operator==(const Acceleration&) const = default;
};

struct BrakeState {
  bool coil_powered = false;
  bool operator==(const BrakeState&) const = default;
};

struct Encoder {
  std::uint16_t encoder_counts = 0;
  std::uint16_t raw_counts = 0;
  std::uint16_t offset_counts = 0;
  // If 0x90 has a type (RS-485): the requested position in full.
  std::uint8_t type = 0;
  std::uint32_t full_counts = 0;
  bool operator==(const Encoder&) const = default;
};

struct MultiTurnAngle {
  std::int64_t angle_cdeg = 0;  // on CAN saturated to kInt56Min..kInt56Max
  bool operator==(const MultiTurnAngle&) const = default;
};

struct SingleTurnAngle {
  std::uint32_t angle_cdeg = 0;
  bool operator==(const SingleTurnAngle&) const = default;
};

struct State1 {
  Opcode command = ReadState1::kOpcode;  // of the query
  double temperature_C = 0;
  double voltage_V = 0;
  std::uint8_t errors = 0;
  double bus_current_A = 0;  // of the third layout only
  bool bridge_on = true;     // of the third layout only
  bool operator==(const State1&) const = default;
};

struct State2 {
  Opcode command = ReadState2::kOpcode;  // of the query
  double temperature_C = 0;
  double iq_A = 0;
  double speed_dps = 0;
  std::uint16_t encoder_counts = 0;
  std::int16_t power_permille = 0;  // per mille of the largest voltage; MS only, which have no iq
  bool operator==(const State2&) const = default;
};

struct State3 {
  double temperature_C = 0;
  double i_a_A = 0, i_b_A = 0, i_c_A = 0;
  bool operator==(const State3&) const = default;
};

struct ParameterValue {
  Parameter parameter;
  Opcode command = ReadParameter::kOpcode;  // of the query
  bool operator==(const ParameterValue&) const = default;
};

// On RS-485 only.

struct SettingValue {
  Setting setting;
  bool operator==(const SettingValue&) const = default;
};

struct SettingWritten {
  Opcode command = WriteSettingToRam::kOpcode;  // of the query
  std::uint8_t id = 0;                          // as received
  bool refused = false;
  bool operator==(const SettingWritten&) const = default;
};

struct DeviceType {
  std::uint16_t type = 0;
  bool operator==(const DeviceType&) const = default;
};

/// Bytes that no field describes: product info, blocks of the tool, or none.
struct Block {
  Opcode command{};       // of the query
  Payload data{};         // from DATA[1] on
  std::uint8_t size = 0;  // bytes of `data`
  bool operator==(const Block&) const = default;
};

/// No reply to an executed command.
struct NoReply {
  bool operator==(const NoReply&) const = default;
};

using Reply = std::variant<Echo, ZeroWritten, Pid, Acceleration, BrakeState, Encoder,
                           MultiTurnAngle, SingleTurnAngle, State1, State2, State3, ParameterValue,
                           SettingValue, SettingWritten, DeviceType, Block, NoReply, Calibrated,
                           MaxTorque, StoredSettingValue, SettingsSaved>;

}  // namespace lk::protocol
