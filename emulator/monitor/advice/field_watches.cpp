#include "emulator/monitor/advice/field_watches.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "emulator/core/servo/registers.hpp"
#include "emulator/monitor/advice/host_watches.hpp"
#include "protocol/command_info.hpp"
#include "protocol/field_values.hpp"

namespace lk::emulator {
namespace {

constexpr BilingualText kIq{"iq {1} is beyond {2} to {3}: the drive takes the nearest of them",
                            "iq {1} 超出 {2} 到 {3}：驱动器取最近的值"};
constexpr BilingualText kIqLimit{
    "the iq limit {1} is beyond {2} to {3}: the drive takes the nearest",
    "iq 限值 {1} 超出 {2} 到 {3}：驱动器取最近的值"};
constexpr BilingualText kPower{
    "power {1} is beyond {2} to {3} per mille: the drive takes the nearest",
    "功率 {1} 超出 {2} 到 {3}（千分之）：驱动器取最近的值"};
constexpr BilingualText kSpeed{
    "{1} dps is beyond Max Speed, {2} to {3} dps: the drive limits the speed",
    "{1} dps 超出 Max Speed（{2} 到 {3} dps）：驱动器不会更快"};
constexpr BilingualText kAngle{"{1}° is beyond Max Angle, {2}° to {3}°: the drive limits the angle",
                               "{1}° 超出 Max Angle（{2}° 到 {3}°）：驱动器不会走得更远"};
constexpr BilingualText kTarget{"the single-turn target {1}° is beyond {2}° to {3}°: not executed",
                                "单圈目标 {1}° 超出 {2}° 到 {3}°：不执行"};
constexpr BilingualText kDirection{"direction {1} is neither {2} nor {3}: not executed",
                                   "方向 {1} 既不是 {2} 也不是 {3}：不执行"};
constexpr BilingualText kOffset{
    "offset {1} is beyond {2} to {3} counts: the drive takes the nearest",
    "零偏 {1} 超出 {2} 到 {3}：驱动器取最近的值"};
constexpr BilingualText kAcceleration{
    "acceleration {1} dps/s is negative: the drive takes 0, no ramp",
    "加速度 {1} dps/s 是负数：驱动器取 0，即没有斜坡"};
constexpr BilingualText kParameter{
    "the value {1} is beyond {2} to {3}: the drive takes the nearest",
    "值 {1} 超出 {2} 到 {3}：驱动器取最近的值"};
constexpr BilingualText kSettingRange{
    "the setting {1} is beyond {2} to {3}: the drive keeps its old value",
    "设置 {1} 超出 {2} 到 {3}：驱动器保留原来的值"};
constexpr BilingualText kAction{
    "0x8C has no action {1} (0 engages, 1 releases, 16 reads): not executed",
    "0x8C 没有动作 {1}（0 抱闸，1 松闸，16 读取）：不执行"};

/// A field's value and its limits.
struct Against {
  const BilingualText* words;
  double value, min, max;
};

/// Returns value and limits of a field with fixed limits, as integers on the wire.
Against on_wire(const BilingualText& words, const protocol::Field& field, std::int64_t raw,
                const KnownDrive& drive) {
  const auto range = protocol::raw_range(field, drive.format);
  return {&words, static_cast<double>(raw), static_cast<double>(range.min),
          static_cast<double>(range.max)};
}

/// Returns value and limits of a field; nullopt if the drive accepts every value.
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
                                             ? protocol::kMaxPower_permille
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
          static_cast<double>(drive.format.series == Series::kMs ? protocol::kMaxPower_permille
                                                                 : protocol::kMaxTorque_lsb)};
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

/// Finds a value that is not in the list of values of its field. Ignores other fields.
std::optional<Finding> no_word(const protocol::Field& field, std::int64_t raw) {
  const auto is_raw = [raw](const protocol::Value& value) { return value.number == raw; };
  if (field.range != protocol::Range::kWords || std::ranges::any_of(field.values, is_raw)) {
    return std::nullopt;
  }
  const auto number = static_cast<double>(raw);
  if (field.parameter >= 0) {
    return finding(AdviceKind::kFieldRange, kSettingRange, number, field.values.front().number,
                   field.values.back().number);
  }
  if (field.values.size() != 2) return finding(AdviceKind::kFieldRange, kAction, number);
  return finding(AdviceKind::kFieldRange, kDirection, number, field.values[0].number,
                 field.values[1].number);
}

/// Returns the fields of a query that this drive uses; in a query for several drives, its slot.
std::span<const protocol::Field> fields_for(const DecodedQuery& query, const KnownDrive& drive) {
  const auto fields = protocol::info_of(query.command, drive.format.dialect.framing).query;
  if (!protocol::is_multi_drive(query.command)) return fields;
  const auto slot = static_cast<std::size_t>(drive.address - protocol::kMinId);
  return slot < fields.size() ? fields.subspan(slot, 1) : std::span<const protocol::Field>();
}

}  // namespace

std::optional<Finding> beyond_range(const DecodedQuery& query, const KnownDrive& drive) {
  if (has_wide_target(query, drive)) return std::nullopt;  // GenerationWatch reports this
  // Last field first: the target is last, and matters more than its direction or speed limit.
  const auto fields = fields_for(query, drive);
  for (std::size_t n = fields.size(); n-- > 0;) {
    const protocol::Field& field = fields[n];
    if (!protocol::present(field, query.data, drive.format)) continue;
    const std::int64_t raw = protocol::raw(field, query.data);
    if (const auto wrong = no_word(field, raw)) return wrong;
    const auto held = against(field, raw, drive);
    if (held && (held->value < held->min || held->value > held->max)) {
      return Finding{AdviceKind::kFieldRange, held->words, {held->value, held->min, held->max}};
    }
  }
  return std::nullopt;
}

namespace {

constexpr std::uint8_t kRestartByte = 0x07;
constexpr std::uint8_t kWriteSetting = 0x42;
constexpr std::uint8_t kSaveSettings = 0x44;
constexpr std::uint8_t kReadParameterByte = 0xC0;
constexpr std::uint8_t kWriteParameterByte = 0xC1;
constexpr std::uint8_t kDriveSettings = 0x05;
constexpr std::uint8_t kSaved = 0x01;

// clang-format off
constexpr BilingualText kNotSaved{"a setting was written with 0x42 and not saved with 0x44 before the restart: it is lost",
                          "用 0x42 写入的设置在重启之前没有用 0x44 保存：已经丢失"};
constexpr BilingualText kParameterAsSetting{"0x42 with the number {1}, which is one of 0xC0 and 0xC1",
                                    "0x42 带编号 {1}，这是 0xC0 和 0xC1 的编号"};
constexpr BilingualText kSettingAsParameter{"{command} with the number {1}, which is one of 0x40 and 0x42",
                                    "{command} 带编号 {1}，这是 0x40 和 0x42 的编号"};
// clang-format on

bool within(std::uint8_t byte, int first, int last) { return byte >= first && byte <= last; }

}  // namespace

std::optional<Finding> mixed_up_tables(const protocol::Payload& data) {
  const std::uint8_t number = data[1];
  const bool writes = data[0] == kWriteSetting;
  const bool parameter = within(number, 0x0A, 0x0C) || within(number, 0x1E, 0x26);
  const bool setting =
      number == kDriveSettings || within(number, 0x96, 0x9E) || within(number, 0xE0, 0xEC);
  const bool accesses = data[0] == kReadParameterByte || data[0] == kWriteParameterByte;
  if (!(writes && parameter) && !(accesses && setting)) return std::nullopt;
  Finding found = finding(AdviceKind::kParameterSpace,
                          writes ? kParameterAsSetting : kSettingAsParameter, number);
  found.command = data[0];
  return found;
}

std::vector<Finding> SettingWatch::on_query(const protocol::Payload& data,
                                            const KnownDrive& drive) {
  std::vector<Finding> found;
  if (const auto mixed = mixed_up_tables(data)) found.push_back(*mixed);
  start_ = drive.starts;
  const bool restarts = data[0] == kRestartByte || pending_start_ != drive.starts;
  if (pending_ && restarts) {
    pending_ = false;
    found.push_back(finding(AdviceKind::kSettingNotSaved, kNotSaved));
  }
  return found;
}

void SettingWatch::on_reply(const protocol::Payload& data) {
  if (data[0] == kWriteSetting) {
    pending_ = true;
    pending_start_ = start_;
  } else if (data[0] == kSaveSettings && data[2] == kSaved) {
    pending_ = false;
  }
}

namespace {

constexpr BilingualText kWearsOut{
    "written {1} times by this host: at this rate the {2} writes that are left in ROM last {3} h",
    "这台主机已写 {1} 次：照此速度，ROM 剩余的 {2} 次擦写只够用 {3} 小时"};
constexpr BilingualText kWornOut{
    "written {1} times by this host: ROM has had all the writes that it is made for",
    "这台主机已写 {1} 次：ROM 的擦写寿命已经用完"};

}  // namespace

std::optional<Finding> RomWatch::on_query(const DecodedQuery& query, const KnownDrive& drive) {
  const bool gains = query.is<protocol::WritePidToRom>();
  if (!gains && !query.is<protocol::WriteOffsetToRom>() && !query.is<protocol::WriteZeroToRom>()) {
    return std::nullopt;
  }
  Writes& writes = gains ? gains_ : offset_;
  writes.at[writes.count % kWrites] = query.at;
  ++writes.count;
  if (writes.count < kWrites) return std::nullopt;
  const auto parameter = gains ? RomParameter::kGains : RomParameter::kEncoderOffset;
  const std::uint32_t written = drive.wear[static_cast<std::size_t>(parameter)];
  const auto count = static_cast<double>(writes.count);
  if (written >= drive.endurance) {
    return Finding{AdviceKind::kRomWear, &kWornOut, {count}, true};
  }
  const double left = drive.endurance - written;
  const SimTime oldest = writes.at[writes.count % kWrites];
  const std::chrono::duration<double> each = (query.at - oldest) / double{kWrites - 1};
  const std::chrono::duration<double, std::ratio<3600>> life = each * left;
  if (life >= kLongLife) return std::nullopt;
  return Finding{AdviceKind::kRomWear, &kWearsOut, {count, left, life.count()}, true};
}

namespace {

constexpr BilingualText kLoaded{
    "0x18 has turned the shaft under a load of {1} Nm; the rated torque is {2} Nm",
    "0x18 转动轴时轴上有 {1} Nm 的负载，而额定转矩是 {2} Nm"};

}  // namespace

std::optional<Finding> CalibrationWatch::observe(const KnownDrive& drive) {
  if (drive.calibrating) {
    sum_Nm_ += drive.torque_Nm;
    ++looks_;
    return std::nullopt;
  }
  const int looks = std::exchange(looks_, 0);
  const double load_Nm = looks > 0 ? std::abs(std::exchange(sum_Nm_, 0)) / looks : 0;
  if (drive.rated_Nm <= 0 || load_Nm <= kShare * drive.rated_Nm) return std::nullopt;
  return finding(AdviceKind::kCalibrationUnderLoad, kLoaded, load_Nm, drive.rated_Nm);
}

namespace {

// clang-format off
constexpr BilingualText kArrived{"the shaft passed {1}° when the host left the speed of {1} dps, {2} times in a row: these values are angles",
                         "连续 {2} 次都在轴转过 {1}° 时换掉了 {1} dps 的速度：主机想说的是角度"};
constexpr BilingualText kPath{"speeds that start at the angle of the shaft and continue in small steps, to {1} dps by now: they are angles",
                      "这串速度从轴的角度开始、以小步变化，现在是 {1} dps：它们其实是角度"};
// clang-format on

}  // namespace

std::optional<Finding> SpeedWatch::on_query(const DecodedQuery& query, const KnownDrive& drive) {
  if (query.is<protocol::ReadMultiTurnAngle>() || query.is<protocol::ReadSingleTurnAngle>()) {
    angle_read_ = query.at;
  }
  const bool ends = query.is<protocol::Off>() || query.is<protocol::Stop>();
  if (!query.motion && !ends) return std::nullopt;
  if (ends || query.motion->opcode != protocol::Speed::kOpcode) {
    value_.reset();
    arrivals_ = 0;
    steps_.reset();
    return std::nullopt;
  }
  const double value = query.motion->value;
  if (!value_) {
    if (starts_at_shaft(value, query.at, drive)) steps_ = 0;
    value_ = value;
    since_ = query.at;
    return std::nullopt;
  }
  auto found = follow_path(value);
  if (value != *value_) {
    if (auto left = leave_target(value, query.at, drive)) found = left;
    value_ = value;
    since_ = query.at;
  }
  return found;
}

bool SpeedWatch::starts_at_shaft(double value, SimTime at, const KnownDrive& drive) const {
  return std::abs(value) >= kLeast_dps && angle_read_ && at - *angle_read_ <= kJustRead &&
         std::abs(value - drive.angle_deg) <= kStart_deg;
}

/// Each step of a path must change the value: a constant value is a speed, or the end of a path.
std::optional<Finding> SpeedWatch::follow_path(double value) {
  if (!steps_) return std::nullopt;
  const double step = std::abs(value - *value_);
  if (step > kStep_dps || (step == 0 && *steps_ < kSteps)) {
    steps_.reset();
    return std::nullopt;
  }
  if (!reached(*steps_, kSteps)) return std::nullopt;
  return finding(AdviceKind::kSpeedAsPosition, kPath, value);
}

std::optional<Finding> SpeedWatch::leave_target(double value, SimTime at, const KnownDrive& drive) {
  const double near_deg = kNear_deg + kReaction_s * std::abs(*value_);
  const bool arrived = at - since_ >= kHeld && std::abs(*value_) >= kLeast_dps &&
                       std::abs(value) >= kLeast_dps &&
                       std::abs(drive.angle_deg - *value_) <= near_deg;
  // In a sweep between two limits, the angle may match the same value repeatedly by chance.
  const bool is_new_value = std::abs(std::abs(*value_) - arrived_dps_) >= kLeast_dps;
  arrivals_ = !arrived ? 0 : is_new_value || arrivals_ == 0 ? arrivals_ + 1 : arrivals_;
  if (arrived) arrived_dps_ = std::abs(*value_);
  if (arrivals_ < kArrivals) return std::nullopt;
  return finding(AdviceKind::kSpeedAsPosition, kArrived, *value_, arrivals_);
}

}  // namespace lk::emulator
