#include "emulator/advice/generation_watch.hpp"

#include <algorithm>
#include <cstdlib>

#include "protocol/wire.hpp"

namespace lk::emulator {
namespace {

using protocol::get_le;

// clang-format off
constexpr Words kLacks{"{command}, {name}: no answer, this drive does not have the command; it is one of {generations}",
                       "{command} 没有回复：这台驱动器没有这条命令，有它的固件代是 {generations}"};
constexpr Words kGiveIt{"if the real drive has it, set {key} in its quirks, or choose a generation that has it; if not, do without",
                        "如果真实驱动器有这条命令，就在 quirks 里设 {key}，或者选用有它的固件代；没有就不要用"};
constexpr Words kNoneHas{"{command}, {name}: no answer, this drive does not have the command, and no generation has it by itself",
                         "{command} 没有回复：这台驱动器没有这条命令，各固件代默认也都没有"};
constexpr Words kSwitchOn{"if the real drive has it, set {key} in its quirks; if not, do without",
                          "如果真实驱动器有这条命令，就在 quirks 里设 {key}；没有就不要用"};
constexpr Words kMyActuator{"no answer, this is no command of LK-TECH drives; MyActuator drives from V3 on have it, and are not emulated",
                            "没有回复：这不是瓴控驱动器的命令；MyActuator V3 起的驱动器有它，本仿真器不支持"};
constexpr Words kOtherDrives{"look up which drives the host was written for (docs/which-drive.md)",
                             "查这个主机程序是为哪种驱动器写的（docs/zh-CN/which-drive.md）"};
constexpr Words kSeriesLacks{"{command}, {name}: no answer, drives of this series do not have the command",
                             "{command} 没有回复：这个系列的驱动器没有这条命令"};
constexpr Words kOtherSeries{"use a command of this series, or a motor of another one (--motor)",
                             "使用这个系列的命令，或者换用另一系列的电机（--motor）"};
constexpr Words kNobodyHas{"{command}: no answer, no generation has the command",
                           "{command} 没有回复：没有哪一代有这条命令"};
constexpr Words kNoParameter{"{command}, {name}: no answer, there is no parameter {1}",
                             "{command} 没有回复：没有参数 {1}"};
constexpr Words kLookUp{"look up the commands that there are (docs/protocol.md, section 3)",
                        "查有哪些命令（docs/zh-CN/protocol.md 第 3 节）"};
constexpr Words kLookUpPackets{"look up the commands that there are (docs/rs485.md, Commands)",
                               "查有哪些命令（docs/rs485.md 的 Commands 一节）"};
constexpr Words kWideTarget{"a target of 32 bits, {1}°: this drive reads 16 bits of it, {2}°",
                            "目标是 32 位的 {1}°：这台驱动器只读其中 16 位，即 {2}°"};
constexpr Words kSetAngle{"0x95 with the angle {1}°: this drive ignores it, only v236 sets its angle so",
                          "0x95 带角度 {1}°：这台驱动器不理会，只有 v236 能这样设定角度"};
constexpr Words kSpeedLimit{"0xA2 with {1} where v236 has an iq limit: this drive has none, its current is not limited by it",
                            "0xA2 在 v236 放 iq 限值的位置带有 {1}：这台驱动器没有这个限值，电流不受它限制"};
// clang-format on

/// Largest plausible angle: a thousand turns (assumed); random 32-bit values are rarely smaller.
constexpr std::int32_t kMostAngle_cdeg = 1000 * 36000;

/// MyActuator command ("Servo Motor Control Protocol" V4.2, from V3 on) that LK-TECH lacks. Both
/// have 0x42: there DATA[1] is one of four accelerations, here a table.
bool is_of_myactuator(const protocol::Frame& frame) {
  const std::uint8_t command = frame.data[0];
  const auto within = [command](int first, int last) {
    return command >= first && command <= last;
  };
  if (protocol::is_serial(frame)) return false;  // RS-485: other packets
  if (command == 0x42) return frame.data[1] <= 3;
  return command == 0x43 || within(0x60, 0x64) || within(0x70, 0x71) || within(0x76, 0x79) ||
         within(0xB1, 0xB6);
}

bool some_generation_has(const protocol::CommandInfo& command, protocol::Framing framing) {
  return std::ranges::any_of(protocol::kGenerationRows, [&](const protocol::GenerationRow& row) {
    return has(row, command, framing);
  });
}

}  // namespace

Finding unknown_command(const protocol::Frame& frame, const KnownDrive& drive) {
  const auto about = [&](const Words& what, const Words* todo, double number = 0) {
    return Finding{AdviceKind::kUnknownCommand, &what, {number}, true, todo, frame.data[0]};
  };
  if (is_of_myactuator(frame)) {  // one advice for all of these
    return Finding{AdviceKind::kUnknownCommand, &kMyActuator, {}, false, &kOtherDrives};
  }
  const protocol::Framing framing = drive.format.dialect.framing;
  const Words* const look_up = framing == protocol::Framing::kCan ? &kLookUp : &kLookUpPackets;
  const protocol::CommandInfo* row = protocol::command_of(frame);
  if (row == nullptr) return about(kNobodyHas, look_up);
  if (!protocol::fits(*row, drive.format.series)) return about(kSeriesLacks, &kOtherSeries);
  if (protocol::knows(drive.format, *row)) return about(kNoParameter, look_up, frame.data[1]);
  if (!some_generation_has(*row, framing)) return about(kNoneHas, &kSwitchOn);
  return about(kLacks, &kGiveIt);
}

bool has_wide_target(const Heard& heard, const KnownDrive& drive) {
  if (drive.format.dialect.framing != protocol::Framing::kCan) return false;  // RS-485: other bytes
  if (!heard.is<protocol::Position3>() && !heard.is<protocol::Position4>()) return false;
  const auto target = get_le<std::uint32_t>(heard.data, 4);
  // The limit is a turn of the output: 36000 times the gear ratio.
  return !drive.format.dialect.wide_single_turn_target && target > 0xFFFF &&
         target < drive.widest_circle_cdeg;
}

std::optional<Finding> GenerationWatch::hear(const Heard& heard, const KnownDrive& drive) {
  const protocol::Payload& data = heard.data;
  const protocol::Dialect& dialect = drive.format.dialect;
  if (dialect.framing != protocol::Framing::kCan) return std::nullopt;  // RS-485: other bytes
  if (has_wide_target(heard, drive)) {
    return Finding{
        AdviceKind::kOtherGeneration,
        &kWideTarget,
        {get_le<std::uint32_t>(data, 4) / 100.0, get_le<std::uint16_t>(data, 4) / 100.0}};
  }
  if (heard.is<protocol::ClearAngle>()) {
    const auto angle = get_le<std::int32_t>(data, 4);
    const bool meant = angle != 0 && angle >= -kMostAngle_cdeg && angle <= kMostAngle_cdeg;
    if (dialect.clear_angle == protocol::ClearAngleMeaning::kSetsAngle || !meant) {
      return std::nullopt;
    }
    return Finding{AdviceKind::kOtherGeneration, &kSetAngle, {angle / 100.0}};
  }
  if (heard.is<protocol::Speed>() && !dialect.speed_iq_limit && data[0] == 0xA2) {
    return hear_limit(get_le<std::int16_t>(data, 2), drive);
  }
  return std::nullopt;
}

std::optional<Finding> GenerationWatch::hear_limit(std::int16_t limit_lsb,
                                                   const KnownDrive& drive) {
  const bool possible = limit_lsb > 0 && limit_lsb <= drive.format.dialect.iq_command_limit_lsb;
  same_limit_ = !possible ? 0 : limit_lsb == limit_lsb_ ? std::min(same_limit_ + 1, kSameLimit) : 1;
  limit_lsb_ = limit_lsb;
  if (same_limit_ < kSameLimit) return std::nullopt;
  return Finding{AdviceKind::kOtherGeneration, &kSpeedLimit, {static_cast<double>(limit_lsb)}};
}

}  // namespace lk::emulator
