#pragma once

/// @file Meanings of numbers and bits in fields.

#include <cstdint>

#include "protocol/commands.hpp"
#include "protocol/field.hpp"
#include "protocol/replies.hpp"

namespace lk::protocol {

// Bit rates, with the codes used in settings and in the vendor's PC tool
// (docs/reference/protocol.md §10.9, docs/reference/rs485.md).
inline constexpr Value kSerialRates[] = {
    {0, "9600"},   {1, "19200"},  {2, "38400"},   {3, "57600"},   {4, "115200"},  {5, "230400"},
    {6, "460800"}, {7, "921600"}, {8, "1000000"}, {9, "2000000"}, {10, "4000000"}};
inline constexpr Value kCanRates[] = {
    {0, "100000"}, {1, "125000"}, {2, "250000"}, {3, "500000"}, {4, "1000000"}};

/// Returns the bit rate of an entry of kSerialRates or kCanRates, bit/s.
constexpr std::int64_t bit_rate(const Value& row) {
  std::int64_t rate = 0;
  for (const char digit : row.word) rate = 10 * rate + (digit - '0');
  return rate;
}
static_assert(bit_rate(kSerialRates[4]) == 115'200);

namespace table {

inline constexpr Value kDirections[] = {{kClockwise, "clockwise"},
                                        {kCounterClockwise, "counterclockwise"}};
inline constexpr Value kBrakeActions[] = {
    {kBrakeEngage, "engage"}, {kBrakeRelease, "release"}, {kBrakeRead, "read"}};
inline constexpr Value kCoil[] = {{0, "unpowered, the brake holds"},
                                  {1, "powered, the brake is open"}};
inline constexpr Value kBridge[] = {{0x00, "on"}, {kBridgeOff, "off"}};
inline constexpr Flag kErrors[] = {{"error_under_voltage", "Under-voltage"},
                                   {"error_over_voltage", "Over-voltage"},
                                   {"error_driver_temperature", "Driver over-temperature"},
                                   {"error_motor_temperature", "Motor over-temperature"},
                                   {"error_over_current", "Over-current"},
                                   {"error_short_circuit", "Short circuit"},
                                   {"error_stall", "Stall"},
                                   {"error_lost_input", "Lost input"}};
inline constexpr Value kParameters[] = {
    {static_cast<unsigned>(ParameterId::kAngleGains), "gains of the angle loop"},
    {static_cast<unsigned>(ParameterId::kSpeedGains), "gains of the speed loop"},
    {static_cast<unsigned>(ParameterId::kCurrentGains), "gains of the current loop"},
    {static_cast<unsigned>(ParameterId::kMaxTorqueCurrent), "Max Torque Current, on MS Max Power"},
    {static_cast<unsigned>(ParameterId::kMaxSpeed), "Max Speed"},
    {static_cast<unsigned>(ParameterId::kMaxAngle), "Max Angle"},
    {static_cast<unsigned>(ParameterId::kCurrentRamp), "current ramp"},
    {static_cast<unsigned>(ParameterId::kSpeedRamp), "speed ramp"}};

inline constexpr Value kCalibrations[] = {
    {0, "not done"},
    {protocol::kCalibrationDone, "done"},
    {protocol::kCalibrationDone | kPhasesReversed, "done, phases reversed"},
    {kPhasesReversed, "not done, phases reversed"}};
inline constexpr Value kSettingTables[] = {{kNamedSettings, "named by the next byte"},
                                           {0xA0, "gains of the angle loop"},
                                           {0xA4, "gains of the speed loop"},
                                           {0xA8, "gains of the current loop"}};
inline constexpr Value kSettingItems[] = {{0x0A, "driver ID"},
                                          {0x0B, "bus type"},
                                          {0x0C, "bit rate on RS-485"},
                                          {0x0D, "bit rate on CAN"},
                                          {0xE0, "Max Torque Current, on MS Max Power"},
                                          {0xE2, "Max Speed"},
                                          {0xE4, "Max Angle"},
                                          {0xEA, "current ramp"},
                                          {0xEC, "speed ramp"}};
inline constexpr Value kSaveTable[] = {{kNamedSettings, "settings"}};
inline constexpr Value kSaveItems[] = {{kSaveItem, "save"}};
inline constexpr Value kBusTypes[] = {{0, "none"}, {1, "RS-485"}, {2, "CAN"}};
inline constexpr Value kSaved[] = {{0, "failed"}, {1, "saved"}};

}  // namespace table
}  // namespace lk::protocol
