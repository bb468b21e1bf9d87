#include "emulator/advice/field_watch.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "emulator/advice/generation_watch.hpp"
#include "emulator/core/servo/registers.hpp"
#include "protocol/command_info.hpp"
#include "protocol/field_values.hpp"

namespace lk::emulator {
namespace {

constexpr Words kIq{"iq {1} is beyond {2} to {3}: the drive takes the nearest of them",
                    "iq {1} 超出 {2} 到 {3}：驱动器取最近的值"};
constexpr Words kIqLimit{"the iq limit {1} is beyond {2} to {3}: the drive takes the nearest",
                         "iq 限值 {1} 超出 {2} 到 {3}：驱动器取最近的值"};
constexpr Words kPower{"power {1} is beyond {2} to {3} per mille: the drive takes the nearest",
                       "功率 {1} 超出 {2} 到 {3}（千分之）：驱动器取最近的值"};
constexpr Words kSpeed{"{1} dps is beyond Max Speed, {2} to {3} dps: the drive goes no faster",
                       "{1} dps 超出 Max Speed（{2} 到 {3} dps）：驱动器不会更快"};
constexpr Words kAngle{"{1}° is beyond Max Angle, {2}° to {3}°: the drive goes no further",
                       "{1}° 超出 Max Angle（{2}° 到 {3}°）：驱动器不会走得更远"};
constexpr Words kTarget{"the single-turn target {1}° is beyond {2}° to {3}°: not executed",
                        "单圈目标 {1}° 超出 {2}° 到 {3}°：不执行"};
constexpr Words kDirection{"direction {1} is neither {2} nor {3}: not executed",
                           "方向 {1} 既不是 {2} 也不是 {3}：不执行"};
constexpr Words kOffset{"offset {1} is beyond {2} to {3} counts: the drive takes the nearest",
                        "零偏 {1} 超出 {2} 到 {3}：驱动器取最近的值"};
constexpr Words kAcceleration{"acceleration {1} dps/s is negative: the drive takes 0, no ramp",
                              "加速度 {1} dps/s 是负数：驱动器取 0，即没有斜坡"};
constexpr Words kParameter{"the value {1} is beyond {2} to {3}: the drive takes the nearest",
                           "值 {1} 超出 {2} 到 {3}：驱动器取最近的值"};
constexpr Words kSettingRange{"the setting {1} is beyond {2} to {3}: the drive keeps what it has",
                              "设置 {1} 超出 {2} 到 {3}：驱动器保留原来的值"};
constexpr Words kAction{"0x8C has no action {1} (0 engages, 1 releases, 16 reads): not executed",
                        "0x8C 没有动作 {1}（0 抱闸，1 松闸，16 读取）：不执行"};

/// A field's value and its limits.
struct Against {
  const Words* words;
  double value, min, max;
};

/// For a field with fixed limits, in integers of the wire.
Against on_wire(const Words& words, const protocol::Field& field, std::int64_t raw,
                const KnownDrive& drive) {
  const auto range = protocol::raw_range(field, drive.format);
  return {&words, static_cast<double>(raw), static_cast<double>(range.min),
          static_cast<double>(range.max)};
}

/// Returns nullopt if every value of the field's bits is allowed.
std::optional<Against> against(const protocol::Field& field, std::int64_t raw,
                               const KnownDrive& drive) {
  using protocol::Range;
  const auto number = static_cast<double>(raw);
  const double value = protocol::quantity(field, raw, drive.format);
  switch (field.range) {
    case Range::kIqCommand:
      return on_wire(kIq, field, raw, drive);
    case Range::kIqLimit:
      return on_wire(kIqLimit, field, raw, drive);
    case Range::kOpenLoop:
      return on_wire(kPower, field, raw, drive);
    case Range::kMaxSpeed:
      return Against{&kSpeed, value, -drive.max_speed_dps, drive.max_speed_dps};
    case Range::kMaxAngle:
      if (drive.max_angle_deg <= 0) return std::nullopt;
      return Against{&kAngle, value, -drive.max_angle_deg, drive.max_angle_deg};
    case Range::kCircle:
      return Against{&kTarget, value, 0, (static_cast<double>(drive.circle_cdeg) - 1) / 100};
    case Range::kEncoder:
      return Against{&kOffset, number, 0, static_cast<double>(drive.max_offset_counts)};
    case Range::kNotNegative:
      return Against{&kAcceleration, number, 0, HUGE_VAL};
    case Range::kMaxCurrent:
      return Against{&kParameter, number, 0,
                     static_cast<double>(drive.format.series == Series::kMs
                                             ? protocol::kMostPower_permille
                                             : drive.format.dialect.iq_command_limit_lsb)};
    case Range::kSpeedSetting:  // 0.01 dps
      return Against{&kParameter, number, 100 * kMinSpeed_dps, 100 * kMaxSpeed_dps};
    case Range::kAngleSetting:  // 0.01°
      return Against{&kParameter, number, 0, 100 * kMaxAngle_deg};
    case Range::kCurrentRamp:  // 1 mA/s
      return Against{&kParameter, number, 0, 1000 * kMaxCurrentRamp_A_s};
    case Range::kMaxTorque:
      return Against{
          &kParameter, number, 0,
          static_cast<double>(drive.format.series == Series::kMs ? protocol::kMostPower_permille
                                                                 : protocol::kMostTorque_lsb)};
    case Range::kBetween:
      return on_wire(kSettingRange, field, raw, drive);
    case Range::kWords:
    case Range::kWidth:
    case Range::kIqReply:
    case Range::kPowerReply:
    case Range::kTurn:
      return std::nullopt;
  }
  return std::nullopt;
}

/// For a field with a fixed list of values.
std::optional<Finding> no_word(const protocol::Field& field, std::int64_t raw) {
  const auto is_raw = [raw](const protocol::Value& value) { return value.number == raw; };
  if (field.range != protocol::Range::kWords || std::ranges::any_of(field.values, is_raw)) {
    return std::nullopt;
  }
  const auto number = static_cast<double>(raw);
  if (field.parameter >= 0) {
    return Finding{AdviceKind::kFieldRange,
                   &kSettingRange,
                   {number, static_cast<double>(field.values.front().number),
                    static_cast<double>(field.values.back().number)}};
  }
  if (field.values.size() != 2) return Finding{AdviceKind::kFieldRange, &kAction, {number}};
  return Finding{AdviceKind::kFieldRange,
                 &kDirection,
                 {number, static_cast<double>(field.values[0].number),
                  static_cast<double>(field.values[1].number)}};
}

/// Fields of a query that concern the drive: its own slot in a query for several drives.
std::span<const protocol::Field> fields_for(const Heard& heard, const KnownDrive& drive) {
  const auto fields = protocol::info_of(heard.command, drive.format.dialect.framing).query;
  if (!protocol::is_multi_drive(heard.command)) return fields;
  const auto slot = static_cast<std::size_t>(drive.address - protocol::kMinId);
  return slot < fields.size() ? fields.subspan(slot, 1) : std::span<const protocol::Field>();
}

}  // namespace

std::optional<Finding> beyond_range(const Heard& heard, const KnownDrive& drive) {
  if (has_wide_target(heard, drive)) return std::nullopt;  // half of a number: reported there
  // Last field first: the way to reach a target comes after it, and matters more.
  const auto fields = fields_for(heard, drive);
  for (std::size_t n = fields.size(); n-- > 0;) {
    const protocol::Field& field = fields[n];
    if (!protocol::present(field, heard.data, drive.format)) continue;
    const std::int64_t raw = protocol::raw(field, heard.data);
    if (const auto wrong = no_word(field, raw)) return wrong;
    const auto held = against(field, raw, drive);
    if (held && (held->value < held->min || held->value > held->max)) {
      return Finding{AdviceKind::kFieldRange, held->words, {held->value, held->min, held->max}};
    }
  }
  return std::nullopt;
}

}  // namespace lk::emulator
