#include "emulator/advice/field_watch.hpp"

#include <cmath>

#include "emulator/core/registers.hpp"
#include "protocol/wire.hpp"

namespace lk::emulator {
namespace {

using protocol::get_le;
using protocol::ParameterId;
using Found = std::optional<Finding>;

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
constexpr Words kAction{"0x8C has no action {1} (0 engages, 1 releases, 16 reads): not executed",
                        "0x8C 没有动作 {1}（0 抱闸，1 松闸，16 读取）：不执行"};

Found check(const Words& words, double value, double min, double max) {
  if (value >= min && value <= max) return std::nullopt;
  return Finding{AdviceKind::kFieldRange, &words, {value, min, max}};
}

struct Ranges {
  const protocol::Payload& data;
  const KnownDrive& drive;
  const std::optional<MotionCommand>& motion;  // of the drive's slot, where there are slots

  double iq_limit() const { return drive.format.dialect.iq_command_limit_lsb; }

  Found operator()(const protocol::Torque&) const {
    return check(kIq, get_le<std::int16_t>(data, 4), -iq_limit(), iq_limit());
  }
  Found operator()(const protocol::MultiTorque&) const {
    const auto slot = static_cast<std::size_t>(drive.id - protocol::kMinId);
    if (slot >= protocol::kMultiDriveSlots) return std::nullopt;
    return check(kIq, get_le<std::int16_t>(data, 2 * slot), -iq_limit(), iq_limit());
  }
  Found operator()(const protocol::MultiSpeed&) const {
    return motion ? speed(motion->value) : std::nullopt;
  }
  Found operator()(const protocol::MultiPosition&) const {
    return motion ? angle(motion->value) : std::nullopt;
  }
  Found operator()(const protocol::OpenLoop&) const {
    return check(kPower, get_le<std::int16_t>(data, 4), -protocol::kOpenLoopLimit_permille,
                 protocol::kOpenLoopLimit_permille);
  }
  Found operator()(const protocol::Speed& command) const {
    if (!drive.format.dialect.speed_iq_limit) return std::nullopt;
    const Found limit = check(kIqLimit, get_le<std::int16_t>(data, 2), 0, iq_limit());
    if (limit && drive.format.series != Series::kMs) return limit;
    return speed(command.speed_dps);
  }
  Found operator()(const protocol::Position1& command) const {
    return angle(command.target_cdeg * 0.01);
  }
  Found operator()(const protocol::Position2& command) const {
    return angle(command.target_cdeg * 0.01);
  }
  Found operator()(const protocol::Position3& command) const {
    return target(command.direction, command.target_cdeg);
  }
  Found operator()(const protocol::Position4& command) const {
    return target(command.direction, command.target_cdeg);
  }
  Found operator()(const protocol::WriteOffsetToRom& command) const {
    return check(kOffset, command.offset_counts, 0, drive.max_offset_counts);
  }
  Found operator()(const protocol::WriteAccelerationToRam& command) const {
    return check(kAcceleration, command.acceleration_dps_s, 0, HUGE_VAL);
  }
  Found operator()(const protocol::Brake& command) const {
    const bool known = command.action == protocol::kBrakeEngage ||
                       command.action == protocol::kBrakeRelease ||
                       command.action == protocol::kBrakeRead;
    if (known) return std::nullopt;
    return Finding{AdviceKind::kFieldRange, &kAction, {static_cast<double>(command.action)}};
  }
  Found operator()(const protocol::WriteParameter& command) const {
    const double value = command.parameter.number;
    switch (command.parameter.id) {
      case ParameterId::kMaxTorqueCurrent:
        return check(
            kParameter, value, 0,
            drive.format.series == Series::kMs ? protocol::kOpenLoopLimit_permille : iq_limit());
      case ParameterId::kMaxSpeed:  // 0.01 dps
        return check(kParameter, value, 100 * kMinSpeed_dps, 100 * kMaxSpeed_dps);
      case ParameterId::kMaxAngle:  // 0.01°
        return check(kParameter, value, 0, 100 * kMaxAngle_deg);
      case ParameterId::kCurrentRamp:  // 1 mA/s
        return check(kParameter, value, 0, 1000 * kMaxCurrentRamp_A_s);
      case ParameterId::kSpeedRamp:
        return check(kAcceleration, value, 0, HUGE_VAL);
      case ParameterId::kAngleGains:
      case ParameterId::kSpeedGains:
      case ParameterId::kCurrentGains:
        return std::nullopt;
    }
    return std::nullopt;
  }
  template <class Other>
  Found operator()(const Other&) const {
    return std::nullopt;
  }

  Found speed(double dps) const {
    return check(kSpeed, dps, -drive.max_speed_dps, drive.max_speed_dps);
  }
  Found angle(double target_deg) const {
    if (drive.max_angle_deg <= 0) return std::nullopt;
    return check(kAngle, target_deg, -drive.max_angle_deg, drive.max_angle_deg);
  }
  Found target(std::uint8_t direction, std::uint32_t target_cdeg) const {
    const Found wrong_way =
        check(kDirection, direction, protocol::kClockwise, protocol::kCounterClockwise);
    const double last_deg = (static_cast<double>(drive.circle_cdeg) - 1) / 100;
    return wrong_way ? wrong_way : check(kTarget, target_cdeg / 100.0, 0, last_deg);
  }
};

}  // namespace

std::optional<Finding> beyond_range(const Heard& heard, const KnownDrive& drive) {
  return std::visit(Ranges{heard.data, drive, heard.motion}, heard.command);
}

}  // namespace lk::emulator
