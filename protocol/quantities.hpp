#pragma once

/// @file Quantities of fields: their keys, units and names.

#include <algorithm>
#include <iterator>
#include <string_view>

#include "protocol/field.hpp"

namespace lk::protocol {

/// Names of a field's quantity: the key in decode, logs and scenarios, and names for people.
struct Quantity {
  std::string_view key;  // ends with its unit
  Unit unit = Unit::kNone;
  std::string_view en = {}, zh = {};  // for people; empty: the value is shown as a word only
};

// clang-format off
inline constexpr Quantity kQuantities[] = {
    {"angle_kp", Unit::kNone, "angle Kp", "角度环 Kp"},
    {"angle_ki", Unit::kNone, "angle Ki", "角度环 Ki"},
    {"speed_kp", Unit::kNone, "speed Kp", "速度环 Kp"},
    {"speed_ki", Unit::kNone, "speed Ki", "速度环 Ki"},
    {"iq_kp", Unit::kNone, "iq Kp", "电流环 Kp"},
    {"iq_ki", Unit::kNone, "iq Ki", "电流环 Ki"},
    {"kp", Unit::kNone, "Kp", "Kp"},
    {"ki", Unit::kNone, "Ki", "Ki"},
    {"kd", Unit::kNone, "Kd", "Kd"},
    {"acceleration_dps_s", Unit::kDegreePerSecond2, "acceleration", "加速度"},
    {"offset_counts", Unit::kCounts, "offset", "零偏"},
    {"power_permille", Unit::kPermille, "power", "功率"},
    {"iq_A", Unit::kAmpere, "iq", "转矩电流"},
    {"iq_limit_A", Unit::kAmpere, "iq limit", "转矩电流限值"},
    {"speed_dps", Unit::kDegreePerSecond, "speed", "速度"},
    {"angle_deg", Unit::kDegree, "angle", "角度"},
    {"turn_deg", Unit::kDegree, "increment", "增量"},
    {"max_speed_dps", Unit::kDegreePerSecond, "max speed", "最大速度"},
    {"max_angle_deg", Unit::kDegree, "max angle", "最大角度"},
    {"max_current_A", Unit::kAmpere, "max torque current", "最大转矩电流"},
    {"max_power_permille", Unit::kPermille, "max power", "最大功率"},
    {"current_ramp_A_s", Unit::kAmperePerSecond, "current ramp", "电流斜坡"},
    {"encoder_counts", Unit::kCounts, "encoder", "编码器位置"},
    {"raw_counts", Unit::kCounts, "raw", "原始位置"},
    {"temperature_C", Unit::kCelsius, "temperature", "温度"},
    {"voltage_V", Unit::kVolt, "voltage", "电压"},
    {"bus_current_A", Unit::kAmpere, "bus current", "母线电流"},
    {"i_a_A", Unit::kAmpere, "ia", "A 相电流"},
    {"i_b_A", Unit::kAmpere, "ib", "B 相电流"},
    {"i_c_A", Unit::kAmpere, "ic", "C 相电流"},
    {"direction"},
    {"errors"},
    {"bridge_on"},
    {"parameter"},
    {"action"},
    {"coil_powered"},
    {"max_angle_low_deg", Unit::kDegree, "max angle, low half", "最大角度低半部"},
    {"max_angle_high", Unit::kNone, "max angle, high half", "最大角度高半部"},
    {"encoder_type", Unit::kNone, "encoder type", "编码器类型"},
    {"device_type"},
    {"refused"},
    {"item"},
    {"driver_id", Unit::kNone, "driver ID", "驱动器 ID"},
    {"bus_type"},
    {"rs485_rate", Unit::kNone, "RS-485 rate code", "RS-485 波特率代码"},
    {"can_rate", Unit::kNone, "CAN rate code", "CAN 波特率代码"},
    {"saved"},
    {"align_value", Unit::kNone, "align value", "对齐值"},
    {"align_ratio", Unit::kNone, "align ratio", "对齐比例"},
    {"calibration"},
    {"max_torque_lsb", Unit::kNone, "max torque current", "最大转矩电流"},
};
// clang-format on

/// Returns the quantity of a key; null if there is none.
constexpr const Quantity* find_quantity(std::string_view key) {
  const auto* const found = std::ranges::find(kQuantities, key, &Quantity::key);
  return found != std::end(kQuantities) ? found : nullptr;
}

}  // namespace lk::protocol
