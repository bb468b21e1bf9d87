#pragma once

/// @file Replies of a drive. command_table.hpp has the positions of their bytes.

#include <cstdint>
#include <variant>

#include "protocol/commands.hpp"
#include "protocol/opcodes.hpp"
#include "protocol/serial_commands.hpp"
#include "protocol/wire.hpp"

namespace lk::protocol {

/// Reply that repeats the query as received, including unused bytes.
struct Echo {
  Payload data{};
  std::uint8_t size = kCanBytes;  // bytes of `data`
  bool operator==(const Echo&) const = default;
};

struct ZeroWritten {
  std::uint32_t offset_counts = 0;
  std::uint8_t encoder = 0;  // on RS-485: which encoder, 0 is that of the motor; on CAN unused
  bool operator==(const ZeroWritten&) const = default;
};

/// Reply to 0x18. All members are 0 if the drive did not start the calibration.
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

/// Value of a setting, in force now or after the next start of the drive.
struct StoredSettingValue {
  StoredSetting setting;
  Opcode command = ReadStoredSetting::kOpcode;  // DATA[0] of the query
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
  // On RS-485 if 0x90 has a type: the type in the query, and the position with all its bits.
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
  Opcode command = ReadState1::kOpcode;  // DATA[0] of the query
  double temperature_C = 0;
  double voltage_V = 0;
  std::uint8_t errors = 0;
  double bus_current_A = 0;  // only with State1Layout::kCentiVoltAndBusCurrent
  bool bridge_on = true;     // only with State1Layout::kCentiVoltAndBusCurrent
  bool operator==(const State1&) const = default;
};

struct State2 {
  Opcode command = ReadState2::kOpcode;  // DATA[0] of the query
  double temperature_C = 0;
  double iq_A = 0;
  double speed_dps = 0;
  std::uint16_t encoder_counts = 0;
  std::int16_t power_permille = 0;  // per mille of the largest voltage; on MS, instead of iq_A
  bool operator==(const State2&) const = default;
};

struct State3 {
  double temperature_C = 0;
  double i_a_A = 0, i_b_A = 0, i_c_A = 0;
  bool operator==(const State3&) const = default;
};

struct ParameterValue {
  Parameter parameter;
  Opcode command = ReadParameter::kOpcode;  // DATA[0] of the query
  bool operator==(const ParameterValue&) const = default;
};

// Replies that only RS-485 has.

struct SettingValue {
  Setting setting;
  bool operator==(const SettingValue&) const = default;
};

struct SettingWritten {
  Opcode command = WriteSettingToRam::kOpcode;  // DATA[0] of the query
  std::uint8_t id = 0;                          // as received
  bool refused = false;
  bool operator==(const SettingWritten&) const = default;
};

struct DeviceType {
  std::uint16_t type = 0;
  bool operator==(const DeviceType&) const = default;
};

/// Reply with bytes that no field describes: product info, a block of the PC tool, or no bytes.
struct Block {
  Opcode command{};       // DATA[0] of the query
  Payload data{};         // from DATA[1] on
  std::uint8_t size = 0;  // bytes of `data`
  bool operator==(const Block&) const = default;
};

/// The drive executes the command without a reply.
struct NoReply {
  bool operator==(const NoReply&) const = default;
};

using Reply = std::variant<Echo, ZeroWritten, Pid, Acceleration, BrakeState, Encoder,
                           MultiTurnAngle, SingleTurnAngle, State1, State2, State3, ParameterValue,
                           SettingValue, SettingWritten, DeviceType, Block, NoReply, Calibrated,
                           MaxTorque, StoredSettingValue, SettingsSaved>;

}  // namespace lk::protocol
