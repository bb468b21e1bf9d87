#include "tools/guess/traits.hpp"

#include <fmt/format.h>

#include <charconv>

#include "emulator/core/frame_text.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {
namespace {

using protocol::Framing;
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
     "9A00000000000000", {"then 80 and 9A within a second, twice; 80 switches the motor off", "再发 80 并在一秒内问 9A，两遍；80 会关闭电机"}, Wires::kBoth, "9A"},
    {"single_turn_bits", 2, {"16", "32"},
     {{{"0x94: angle in 16 bits at [6:7]", "0x94：角度为 [6:7] 的 16 位"},
       {"0x94: angle in 32 bits at [4:7]", "0x94：角度为 [4:7] 的 32 位"}}},
     [](const Quirks& q) { return flag(q.dialect.wide_single_turn); },
     "9400000000000000", {"with the shaft 1° or more from zero", "轴离零点至少 1°"}},
    {"pid_commands", 2, {kFlags[0], kFlags[1]},
     {{{"0x30..0x34 unanswered", "0x30..0x34 无应答"}, {"0x30..0x34 answered", "0x30..0x34 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.pid_commands); },
     "3000000000000000", {"three times, between other queries", "问三次，夹在其他命令之间"}, Wires::kBoth, "30"},
    {"offset_command", 2, {kFlags[0], kFlags[1]},
     {{{"0x91 unanswered", "0x91 无应答"}, {"0x91 answered", "0x91 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.offset_command); },
     "", {"0x91, but it writes the ROM: better not", "0x91，但会写 ROM，最好不用"}, Wires::kBoth},
    {"brake_command", 2, {kFlags[0], kFlags[1]},
     {{{"0x8C unanswered", "0x8C 无应答"}, {"0x8C answered", "0x8C 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.brake_command); },
     "8C10000000000000", {"three times, between other queries", "问三次，夹在其他命令之间"}, Wires::kBoth, "8C10"},
    {"parameter_commands", 2, {kFlags[0], kFlags[1]},
     {{{"0xC0, 0xC1 unanswered", "0xC0、0xC1 无应答"}, {"0xC0, 0xC1 answered", "0xC0、0xC1 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.parameter_commands); },
     "C00A000000000000", {"three times, between other queries", "问三次，夹在其他命令之间"}, Wires::kBoth, "C00A000000000000"},
    {"max_torque_commands", 2, {kFlags[0], kFlags[1]},
     {{{"0x37, 0x38 unanswered", "0x37、0x38 无应答"}, {"0x37, 0x38 answered", "0x37、0x38 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.max_torque_commands); },
     "3700000000000000", {"three times, between other queries", "问三次，夹在其他命令之间"}, Wires::kBoth, "37"},
    {"setting_commands", 2, {kFlags[0], kFlags[1]},
     {{{"0x40, 0x42, 0x44 unanswered", "0x40、0x42、0x44 无应答"}, {"0x40, 0x42, 0x44 answered", "0x40、0x42、0x44 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.setting_commands); },
     "40050A0000000000", {"three times, between other queries", "问三次，夹在其他命令之间"}, Wires::kBoth, "409600"},
    {"calibrate_command", 2, {kFlags[0], kFlags[1]},
     {{{"0x18 unanswered", "0x18 无应答"}, {"0x18 answered", "0x18 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.calibrate_command); },
     "", {"0x18, but it turns the shaft and writes the ROM: better not", "0x18，但会转动轴并写 ROM，最好不用"}, Wires::kBoth},
    {"zero_reply_bits", 2, {"16", "32"},
     {{{"0x19: offset in 16 bits at [6:7], on RS-485 two bytes", "0x19：零偏为 [6:7] 的 16 位，RS-485 上为两个字节"},
       {"0x19: offset in 32 bits at [4:7], on RS-485 seven bytes", "0x19：零偏为 [4:7] 的 32 位，RS-485 上为七个字节"}}},
     [](const Quirks& q) { return flag(q.dialect.wide_zero_reply); },
     "", {"0x19, but it writes the ROM: better not", "0x19，但会写 ROM，最好不用"}, Wires::kBoth},
    {"open_loop_command", 2, {kFlags[0], kFlags[1]},
     {{{"0xA0 unanswered", "0xA0 无应答"}, {"0xA0 answered", "0xA0 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.open_loop_command); },
     "A000000000000000", {"three times, between other queries; MS only", "问三次，夹在其他命令之间；仅 MS"}, Wires::kBoth, "A00000"},
    {"multi_drive_more", 2, {kFlags[0], kFlags[1]},
     {{{"0x281, 0x282 unanswered where 0x280 is answered", "应答 0x280，但不应答 0x281、0x282"},
       {"0x281, 0x282, 0x288 answered", "0x281、0x282、0x288 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.multi_drive_more); },
     "", {"0x280 and 0x281 in turns, three times, in multi-drive mode", "在多电机模式下轮流发 0x280 和 0x281，三遍"}},
    {"all_error_bits", 2, {kFlags[0], kFlags[1]},
     {{{"errors in bits 0 and 3", "错误只用位 0 和 3"}, {"errors in other bits than 0 and 3", "错误用到位 0 和 3 以外的位"}}},
     [](const Quirks& q) { return flag(q.dialect.all_error_bits); },
     "", {"0x9A while an error is latched in another bit than 0 and 3", "在位 0 和 3 以外的错误锁存时发 0x9A"}, Wires::kBoth},
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
       // Frames do not show the difference between "zero" and "implemented".
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
     {{{"0xA2: iq beyond the limit at [2:3], on RS-485 LEN 6 unanswered", "0xA2：转矩电流超过 [2:3] 的限值，RS-485 上 LEN 6 无应答"},
       {"0xA2: iq limit at [2:3], on RS-485 LEN 6 answered", "0xA2：[2:3] 为转矩电流限值，RS-485 上 LEN 6 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.speed_iq_limit); },
     "", {"0xA2 with a limit at [2:3] that the load exceeds; on RS-485 0xA2 with LEN 6, three times", "带 [2:3] 限值的 0xA2，负载超过它；RS-485 上 LEN 6 的 0xA2，三次"}, Wires::kBoth},
    {"typed_encoder", 2, {kFlags[0], kFlags[1]},
     {{{"0x90 answered with six bytes", "0x90 回复六个字节"}, {"0x90 answered with seven bytes", "0x90 回复七个字节"}}},
     [](const Quirks& q) { return flag(q.dialect.typed_encoder); },
     "", {"", ""}, Wires::kSerial, "90"},
    {"product_info_bytes", 3, {"0", "42", "58"},
     {{{"0x12 unanswered", "0x12 无应答"}, {"0x12 answered with 42 bytes", "0x12 回复 42 个字节"}, {"0x12 answered with 58 bytes", "0x12 回复 58 个字节"}}},
     [](const Quirks& q) -> std::size_t { return q.dialect.product_info_bytes == 0 ? kNoProduct : q.dialect.product_info_bytes == 42 ? kShortProduct : kLongProduct; },
     "", {"", ""}, Wires::kSerial, "12"},
    {"clear_turns_command", 2, {kFlags[0], kFlags[1]},
     {{{"0x93 unanswered", "0x93 无应答"}, {"0x93 answered", "0x93 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.clear_turns_command); },
     "", {"0x93, three times; it clears the turns", "0x93，三次；会清除圈数"}, Wires::kSerial},
    {"zero_ram_command", 2, {kFlags[0], kFlags[1]},
     {{{"0x95 unanswered", "0x95 无应答"}, {"0x95 answered", "0x95 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.zero_ram_command); },
     "", {"0x95, but it renames the position: better not", "0x95，但会重新命名位置，最好不用"}, Wires::kSerial},
    {"zero_ram_len", 2, {"0", "7"},
     {{{"0x95 with LEN 0", "0x95 的 LEN 为 0"}, {"0x95 with LEN 7 answered", "0x95 的 LEN 为 7 时有应答"}}},
     [](const Quirks& q) -> std::size_t { return q.dialect.zero_ram_len == 7 ? 1 : 0; },
     "", {"0x95 with LEN 7, but it renames the position: better not", "LEN 为 7 的 0x95，但会重新命名位置，最好不用"}, Wires::kSerial},
    {"zero_answered", 2, {kFlags[0], kFlags[1]},
     {{{"0x19 unanswered", "0x19 无应答"}, {"0x19 answered", "0x19 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.zero_answered); },
     "", {"0x19, but it writes the ROM: better not", "0x19，但会写 ROM，最好不用"}, Wires::kSerial},
    {"tool_commands", 2, {kFlags[0], kFlags[1]},
     {{{"0x10, 0x11, 0x14 and others of the PC tool unanswered", "0x10、0x11、0x14 等上位机命令无应答"}, {"0x10, 0x11, 0x14 and others of the PC tool answered", "0x10、0x11、0x14 等上位机命令有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.tool_commands); },
     "", {"three times, between other queries", "问三次，夹在其他命令之间"}, Wires::kSerial, "1F"},
    {"restore_command", 2, {kFlags[0], kFlags[1]},
     {{{"0x89 unanswered", "0x89 无应答"}, {"0x89 answered", "0x89 有应答"}}},
     [](const Quirks& q) { return flag(q.dialect.restore_command); },
     "", {"0x89, whose meaning is unknown: better not", "0x89，含义不明，最好不用"}, Wires::kSerial},
    {"encoder_span", 2, {"rotor_turn", "output_turn"},
     {{{"the encoder field begins anew with every turn of the rotor", "编码器位置每转子一圈重新开始"},
       {"0x94 or the encoder field spans a turn of the output", "0x94 或编码器位置对应输出轴一圈"}}},
     nullptr, "9400000000000000", {"at several places of a turn of the output; or 0x9C and 0x92, three times, the shaft turned by 90° of the rotor in between", "在输出轴一圈的几个位置上；或者 0x9C 和 0x92，三遍，其间转子转过 90°"}, Wires::kBoth, "92"},
    {"encoder_bits", 2, {"14", "16"},
     {{{"360° in 0x92 are 16384 counts of the encoder field", "0x92 的 360° 为编码器位置的 16384 个计数"},
       {"the encoder field exceeds 16383, or 360° in 0x92 are 65536 counts", "编码器位置超过 16383，或 0x92 的 360° 为 65536 个计数"}}},
     nullptr, "", {"0x9C and 0x92 at several places of a turn", "在一圈的几个位置上发 0x9C 和 0x92"}, Wires::kBoth},
    {"", 2, {"MF, MG or MH", "MS"},
     {{{"0xA1 and 0x9D answered, or the drive says so: not MS", "0xA1、0x9D 有应答，或驱动器自称：不是 MS"},
       {"MS: 0xA0 answered, or 0xA1 and 0x9D not, or the drive says so", "MS：应答 0xA0，或不应答 0xA1、0x9D，或驱动器自称"}}},
     nullptr, "9D00000000000000", {"three times, between other queries", "问三次，夹在其他命令之间"}, Wires::kBoth, "9D"},
}};
// clang-format on

}  // namespace

const TraitRow& row_of(Trait trait) { return kRows.at(static_cast<std::size_t>(trait)); }

ValueSet all_of(Trait trait) { return static_cast<ValueSet>((1U << row_of(trait).count) - 1U); }

bool shows_on(Trait trait, protocol::Framing framing) {
  const Wires wires = row_of(trait).wires;
  return wires == Wires::kBoth || (wires == Wires::kSerial) == (framing == Framing::kSerial);
}

bool has_probe(Trait trait, Framing framing) {
  const TraitRow& row = row_of(trait);
  return !(framing == Framing::kCan ? row.probe : row.serial_probe).empty();
}

std::string probe_text(Trait trait, int drive, Framing framing) {
  if (!has_probe(trait, framing)) return "";
  const unsigned id = protocol::kSingleDriveId + static_cast<unsigned>(drive);
  if (framing == Framing::kCan) return fmt::format("{:03X}#{}", id, row_of(trait).probe);
  const std::string_view data = row_of(trait).serial_probe;
  protocol::Frame frame;
  frame.kind = protocol::FrameKind::kSerial;
  frame.id = id;
  frame.dlc = static_cast<std::uint8_t>(data.size() / 2);
  for (std::size_t n = 0; n < frame.dlc; ++n) {
    std::from_chars(&data[2 * n], &data[2 * n] + 2, frame.data[n], 16);
  }
  return frame_text(frame);
}

std::optional<Trait> trait_of_command(Opcode opcode, Framing framing) {
  const auto* const command = protocol::find_command(static_cast<std::uint8_t>(opcode), framing);
  if (command == nullptr) return std::nullopt;
  if (command->fits == protocol::Fits::kAllButMs) return Trait::kSeries;
  if (framing == Framing::kSerial) {
    if (opcode == protocol::ReadProduct::kOpcode) return Trait::kProduct;
    if (opcode == protocol::ReadEncoder::kOpcode) return Trait::kEncoderForm;
    if (opcode == protocol::WriteZeroToRom::kOpcode) return Trait::kZeroAnswered;
  }
  const auto* const row = std::ranges::find_if(kRows, [command](const TraitRow& one) {
    return command->when.words == std::string(one.key) + " = true";
  });
  if (row == std::end(kRows)) return std::nullopt;
  return static_cast<Trait>(std::distance(std::begin(kRows), row));
}

}  // namespace lk::emulator
