#include "tools/guess/traits.hpp"

#include <fmt/format.h>

#include <charconv>

#include "emulator/core/frame_text.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {
namespace {

using protocol::Opcode;

std::size_t flag(bool on) { return on ? kSwitchedOn : kSwitchedOff; }

constexpr std::string_view kFlags[] = {"false", "true"};

/// In the order of Trait.
// clang-format off
constexpr std::array<TraitRow, kTraitCount> kRows{{
    {"reply_id_base", 3, {"0x140", "0x180", "0x240"},
     {{{"replies on 0x140 + ID", "回复帧标识符为 0x140 + ID"},
       {"replies on 0x180 + ID", "回复帧标识符为 0x180 + ID"},
       {"replies on 0x240 + ID", "回复帧标识符为 0x240 + ID"}}},
     [](const Quirks& q) -> std::size_t { return q.dialect.reply_id_base == protocol::kSingleDriveId ? 0 : 1; },
     "9A00000000000000", {"twice", "两次"}},
    {"state_1", 3, {"decivolt", "centivolt", "centivolt_and_bus_current"},
     {{{"0x9A: voltage 0.1 V at [3:4]", "0x9A：电压在 [3:4]，0.1 V"},
       {"0x9A: voltage 0.01 V at [2:3], [4:6] are 0", "0x9A：电压在 [2:3]，0.01 V，[4:6] 为 0"},
       {"0x9A: voltage 0.01 V at [2:3], bus current at [4:5], on or off at [6]",
        "0x9A：电压在 [2:3]，0.01 V，母线电流在 [4:5]，[6] 为开关状态"}}},
     [](const Quirks& q) { return static_cast<std::size_t>(q.dialect.state_1); },
     "9A00000000000000", {"then 80 and 9A within a second, twice; 80 switches the motor off", "再发 80 并在一秒内问 9A，两遍；80 会关闭电机"}},
    {"single_turn_bits", 2, {"16", "32"},
     {{{"0x94: angle in 16 bits at [6:7]", "0x94：角度为 [6:7] 的 16 位"},
       {"0x94: angle in 32 bits at [4:7]", "0x94：角度为 [4:7] 的 32 位"}}},
     [](const Quirks& q) { return flag(q.dialect.wide_single_turn); },
     "9400000000000000", {"with the shaft 1° or more from zero", "轴离零点至少 1°"}},
    {"pid_commands", 2, {kFlags[0], kFlags[1]},
     {{{"0x30..0x34 unanswered", "0x30..0x34 无应答"}, {"0x30..0x34 answered", "0x30..0x34 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.pid_commands); },
     "3000000000000000", {"three times, between other queries", "问三次，夹在其他命令之间"}},
    {"offset_command", 2, {kFlags[0], kFlags[1]},
     {{{"0x91 unanswered", "0x91 无应答"}, {"0x91 answered", "0x91 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.offset_command); },
     "", {"0x91, but it writes the ROM: better not", "0x91，但会写 ROM，最好不用"}},
    {"brake_command", 2, {kFlags[0], kFlags[1]},
     {{{"0x8C unanswered", "0x8C 无应答"}, {"0x8C answered", "0x8C 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.brake_command); },
     "8C10000000000000", {"three times, between other queries", "问三次，夹在其他命令之间"}},
    {"parameter_commands", 2, {kFlags[0], kFlags[1]},
     {{{"0xC0, 0xC1 unanswered", "0xC0、0xC1 无应答"}, {"0xC0, 0xC1 answered", "0xC0、0xC1 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.parameter_commands); },
     "C00A000000000000", {"three times, between other queries", "问三次，夹在其他命令之间"}},
    {"max_torque_commands", 2, {kFlags[0], kFlags[1]},
     {{{"0x37, 0x38 unanswered", "0x37、0x38 无应答"}, {"0x37, 0x38 answered", "0x37、0x38 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.max_torque_commands); },
     "3700000000000000", {"three times, between other queries", "问三次，夹在其他命令之间"}},
    {"setting_commands", 2, {kFlags[0], kFlags[1]},
     {{{"0x40, 0x42, 0x44 unanswered", "0x40、0x42、0x44 无应答"}, {"0x40, 0x42, 0x44 answered", "0x40、0x42、0x44 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.setting_commands); },
     "40050A0000000000", {"three times, between other queries", "问三次，夹在其他命令之间"}},
    {"calibrate_command", 2, {kFlags[0], kFlags[1]},
     {{{"0x18 unanswered", "0x18 无应答"}, {"0x18 answered", "0x18 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.calibrate_command); },
     "", {"0x18, but it turns the shaft and writes the ROM: better not", "0x18，但会转动轴并写 ROM，最好不用"}},
    {"zero_reply_bits", 2, {"16", "32"},
     {{{"0x19: offset in 16 bits at [6:7]", "0x19：零偏为 [6:7] 的 16 位"},
       {"0x19: offset in 32 bits at [4:7]", "0x19：零偏为 [4:7] 的 32 位"}}},
     [](const Quirks& q) { return flag(q.dialect.wide_zero_reply); },
     "", {"0x19, but it writes the ROM: better not", "0x19，但会写 ROM，最好不用"}},
    {"open_loop_command", 2, {kFlags[0], kFlags[1]},
     {{{"0xA0 unanswered", "0xA0 无应答"}, {"0xA0 answered", "0xA0 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.open_loop_command); },
     "A000000000000000", {"three times, between other queries; MS only", "问三次，夹在其他命令之间；仅 MS"}},
    {"multi_drive_more", 2, {kFlags[0], kFlags[1]},
     {{{"0x281, 0x282 unanswered where 0x280 is answered", "应答 0x280，但不应答 0x281、0x282"},
       {"0x281, 0x282, 0x288 answered", "0x281、0x282、0x288 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.multi_drive_more); },
     "", {"0x280 and 0x281 in turns, three times, in multi-drive mode", "在多电机模式下轮流发 0x280 和 0x281，三遍"}},
    {"all_error_bits", 2, {kFlags[0], kFlags[1]},
     {{{"errors in bits 0 and 3", "错误只用位 0 和 3"}, {"errors in other bits than 0 and 3", "错误用到位 0 和 3 以外的位"}}},
     [](const Quirks& q) { return flag(q.dialect.all_error_bits); },
     "", {"0x9A while an error is latched in another bit than 0 and 3", "在位 0 和 3 以外的错误锁存时发 0x9A"}},
    {"manual_reply_bytes", 2, {kFlags[0], kFlags[1]},
     {{{"replies to 0x9B, 0xA7, 0xA8 repeat the command", "0x9B、0xA7、0xA8 的回复重复命令字节"},
       {"replies to 0x9B, 0xA7, 0xA8 have DATA[0] 0x9A, 0xA5, 0xA6", "0x9B、0xA7、0xA8 的回复 DATA[0] 为 0x9A、0xA5、0xA6"}}},
     [](const Quirks& q) { return flag(q.manual_reply_bytes); },
     "9B00000000000000", {"twice; it clears errors", "两次；会清除错误"}},
    {"clear_angle", 3, {"ignored", "implemented", "sets_angle"},
     {{{"0x95 leaves the multi-turn angle", "0x95 不改变多圈角度"},
       {"0x95 sets the multi-turn angle to 0", "0x95 把多圈角度清零"},
       {"0x95 sets the multi-turn angle to [4:7]", "0x95 把多圈角度设为 [4:7]"}}},
     [](const Quirks& q) -> std::size_t {
       // What is different about "zero" does not show.
       const auto meaning = q.dialect.clear_angle;
       return meaning == protocol::ClearAngleMeaning::kZero ? 1 : static_cast<std::size_t>(meaning);
     },
     "9200000000000000", {"then 9500000050460000 and 92 within a second; turn the shaft by 90°; 92, 95000000A08C0000, 92; each time with the shaft at rest and more than 50° from 0, 180 and 360; it renames the position",
      "再在一秒内发 9500000050460000 和 92；把轴转过 90°；92、95000000A08C0000、92；每次轴静止，离 0、180 和 360 超过 50°；位置会被重新命名"}},
    {"run_resumes", 2, {kFlags[0], kFlags[1]},
     {{{"0x88 after 0x81: nothing moves until the next command", "0x81 之后的 0x88：到下一条命令之前不动"},
       {"0x88 after 0x81: the command resumes", "0x81 之后的 0x88：恢复原命令"}}},
     [](const Quirks& q) { return flag(q.run_resumes); },
     "", {"0xA2, 0x81, 0x88, 0x9C and 0xA2, twice, with a free shaft", "0xA2、0x81、0x88、0x9C、0xA2，两遍，轴空载"}},
    {"speed_iq_limit", 2, {kFlags[0], kFlags[1]},
     {{{"0xA2: iq beyond the limit at [2:3]", "0xA2：转矩电流超过 [2:3] 的限值"},
       {"0xA2: iq limit at [2:3]", "0xA2：[2:3] 为转矩电流限值"}}},
     [](const Quirks& q) { return flag(q.dialect.speed_iq_limit); },
     "", {"0xA2 with a limit at [2:3] that the load exceeds", "带 [2:3] 限值的 0xA2，负载超过它"}},
    {"encoder_span", 2, {"rotor_turn", "output_turn"},
     {{{"0x94 spans a turn of the rotor", "0x94 对应转子一圈"},
       {"0x94 goes beyond 359.99°: a turn of the output", "0x94 超过 359.99°：输出轴一圈"}}},
     nullptr, "9400000000000000", {"at several places of a turn of the output", "在输出轴一圈的几个位置上"}},
    {"", 2, {"MF, MG or MH", "MS"},
     {{{"0xA1 and 0x9D answered: not MS", "0xA1、0x9D 有应答：不是 MS"},
       {"MS: 0xA0 answered, or 0xA1 and 0x9D not", "MS：应答 0xA0，或不应答 0xA1、0x9D"}}},
     nullptr, "9D00000000000000", {"three times, between other queries", "问三次，夹在其他命令之间"}},
}};
// clang-format on

/// LEN of what is asked on RS-485 (docs/rs485.md).
std::uint8_t len_of(std::uint8_t command) {
  return command == 0x8C ? 1 : command == 0xA0 ? 2 : command == 0xC0 ? 7 : 0;
}

}  // namespace

const TraitRow& row_of(Trait trait) { return kRows.at(static_cast<std::size_t>(trait)); }

ValueSet all_of(Trait trait) { return static_cast<ValueSet>((1U << row_of(trait).count) - 1U); }

std::string probe_text(Trait trait, int drive, protocol::Framing framing) {
  const std::string_view data = row_of(trait).probe;
  if (data.empty()) return "";
  if (framing == protocol::Framing::kSerial) {
    protocol::Frame frame;
    frame.kind = protocol::FrameKind::kSerial;
    frame.id = protocol::kSingleDriveId + static_cast<unsigned>(drive);
    for (std::size_t n = 0; n < protocol::kCanBytes; ++n) {
      std::from_chars(&data[2 * n], &data[2 * n] + 2, frame.data[n], 16);
    }
    frame.dlc = static_cast<std::uint8_t>(1 + len_of(frame.data[0]));
    return frame_text(frame);
  }
  return fmt::format("{:03X}#{}", protocol::kSingleDriveId + static_cast<unsigned>(drive), data);
}

std::optional<Trait> trait_behind(Opcode opcode) {
  const auto* const command = protocol::find_command(static_cast<std::uint8_t>(opcode));
  if (command == nullptr) return std::nullopt;
  if (command->fits == protocol::Fits::kAllButMs) return Trait::kSeries;
  const auto* const row = std::ranges::find_if(kRows, [command](const TraitRow& one) {
    return command->when.words == std::string(one.key) + " = true";
  });
  if (row == std::end(kRows)) return std::nullopt;
  return static_cast<Trait>(std::distance(std::begin(kRows), row));
}

}  // namespace lk::emulator
