#include "emulator/monitor/advice/advice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>

#include "emulator/core/frame_text.hpp"
#include "emulator/core/scenario/scenario_text.hpp"
#include "emulator/core/text.hpp"
#include "protocol/command_info.hpp"
#include "protocol/wire_format.hpp"

namespace lk::emulator {
namespace {

// clang-format off
constexpr std::array<AdviceRow, kAdviceKinds> kTable = {{
    {AdviceKind::kRomWear, "rom-wear",
     {"10 writes of the gains, or 10 of the encoder offset, at a rate that wears them out within 365 days",
      "增益或编码器零偏写了 10 次，且照此速度会在 365 天内把存储单元写坏"},
     {"write the gains to RAM with 0x31, and to ROM once they are final; set the zero once, when the robot is assembled",
      "增益用 0x31 写入 RAM，定稿后再写一次 ROM；零点只在装配机器人时设一次"}},
    {AdviceKind::kMotionRefused, "motion-refused",
     {"a motion command that is not executed because the drive is off; if it has an error, from 100 ms after the host reads it with 0x9A or 0x9B, or else from 2 s after the error",
      "驱动器已关闭，运动命令没有执行；有错误时，从主机用 0x9A 或 0x9B 询问之后 100 ms 起算，没有询问则从出错之后 2 s 起算"},
     {"switch the drive on with 0x88, then move; with an error, clear it with 0x9B first",
      "先用 0x88 运行，然后才发运动命令；有错误时，先用 0x9B 清除错误标志"},
     true},
    {AdviceKind::kSpeedAsPosition, "speed-as-position",
     {"values of 0xA2 of 5 dps and more that are angles: three in a row, each of another size than the one before, were held for 100 ms and left when the shaft passed that angle; or they start within 0.3° of the angle the host has just read, and continue in 10 steps of at most 5 dps",
      "0xA2 的值不小于 5 dps 而实为角度：连续三个值，每个都与前一个大小不同，都保持了 100 ms，又恰在轴转过该角度时换掉；或者从主机刚读到的角度（相差不超过 0.3°）开始，接着有 10 步，每步不超过 5 dps"},
     {"send positions with 0xA3 or 0xA4: the value of 0xA2 is a speed, and the shaft turns on after it has passed the angle",
      "位置用 0xA3 或 0xA4 发送：0xA2 的值是速度，轴转过该角度后不会停下"}},
    {AdviceKind::kFieldRange, "field-range",
     {"a field beyond what the drive takes: it is clamped, or the command is not executed",
      "某个字段超出驱动器接受的范围：被限幅，或者命令不执行"},
     {"keep the field within its range (docs/reference/protocol.md, sections 2 and 10)",
      "让该字段保持在范围之内（docs/zh-CN/reference/protocol.md 第 2、10 节）"},
     true,
     {"keep the field within its range (docs/reference/rs485.md, Commands)",
      "让该字段保持在范围之内（docs/reference/rs485.md 的 Commands 一节）"}},
    {AdviceKind::kOtherGeneration, "other-generation",
     {"a field where only another generation has one: 0xA5 and 0xA6 with a 32-bit target, 0x95 with an angle, 0xA2 with the same iq limit 10 times; or 3 times an identifier for several drives that only another generation has",
      "字段放在只有别的固件代才有的位置：0xA5、0xA6 带 32 位目标，0x95 带角度，0xA2 带同一个 iq 限值 10 次；或者只有别的固件代才有的多电机标识符出现 3 次"},
     {"use the layout of this drive's generation, or give the drive the generation that the host was written for (docs/reference/protocol.md, section 10)",
      "按这台驱动器的固件代排列字段，或者把驱动器设为主机所针对的固件代（docs/zh-CN/reference/protocol.md 第 10 节）"},
     true},
    {AdviceKind::kWrongLength, "wrong-length",
     {"a frame for the drive with a DLC other than 8, or on RS-485 with another LEN than its command has: it is not answered",
      "发给驱动器的帧 DLC 不是 8，或者 RS-485 上 LEN 与命令不符：没有回复"},
     {"give each frame the length of its command: 8 bytes on CAN, unused ones 0",
      "每帧的长度要与命令相符：CAN 上都是 8 个字节，不用的字节填 0"},
     false,
     {"give each packet the LEN of its command (docs/reference/rs485.md, Commands)",
      "每个数据包的 LEN 要与命令相符（docs/reference/rs485.md 的 Commands 一节）"}},
    {AdviceKind::kSeveralHosts, "several-hosts",
     {"8 times more often than not, within 1 s of each other, a motion command of another kind or value among 7 that keep a rhythm at least four times steadier than that of all together, not close to its neighbours and not in place of one of them",
      "7 条保持节奏的运动命令之间夹着种类或数值不同的一条，这一节奏比全部命令合在一起至少稳四倍；夹着的一条不紧挨前后，也没有顶替其中一条；这样的情形比相反的情形多 8 次，相邻两次不超过 1 s"},
     {"let one program command a drive; others may listen",
      "一台驱动器只由一个程序发命令，其他程序只监听"}},
    {AdviceKind::kFasterThanWire, "faster-than-wire",
     {"more than 64 frames wait for the wire, for 100 ms, or the send queue of 1024 runs over",
      "等待上线的帧超过 64 个，持续 100 ms；或者 1024 帧的发送队列溢出"},
     {"lower the rate, or send the next query when the reply has come: a query and its reply take about 0.25 ms at 1 Mbit/s",
      "降低频率，或者收到回复再发下一条命令帧：1 Mbit/s 下一条命令帧加回复约占 0.25 ms"},
     false,
     {"lower the rate, or send the next packet when the reply has come",
      "降低频率，或者收到回复再发下一个数据包"}},
    {AdviceKind::kFasterThanDrive, "faster-than-drive",
     {"a query that the drive does not take because 16 replies wait in it already",
      "驱动器里已有 16 个回复在等待，命令帧不被接受"},
     {"wait for the reply before the next query, for that to a ROM write above all",
      "收到回复再发下一条命令帧，写 ROM 之后尤其如此"}},
    {AdviceKind::kNotWaited, "not-waited",
     {"20 queries in a row that come before the reply to the one before can have come",
      "连续 20 条命令帧，都在上一条的回复还不可能到达时就发出"},
     {"read the reply before the next query to this drive; without it, the host cannot know whether the drive accepted the command",
      "先读回复，再向这台驱动器发下一条命令帧；不读回复就不知道命令是否被接受"}},
    {AdviceKind::kInputWindow, "input-window",
     {"3 pauses of the host, each of 0.8 to 3 times the time-out of the lost-input protection",
      "主机停顿的时间达到输入丢失保护时间的 0.8 到 3 倍，共 3 次"},
     {"send a frame to the drive at least twice in that time-out, or lengthen it",
      "在这段时间内至少向驱动器发两帧，或者把它设长"}},
    {AdviceKind::kWindUp, "wind-up",
     {"10 increments of 0xA7 or 0xA8 in one direction, for 1 s, of which the shaft is behind by more than 1 s",
      "0xA7 或 0xA8 朝同一方向给了 10 次增量，历时 1 s，而轴落后 1 s 以上"},
     {"wait until the shaft follows, or send absolute targets with 0xA3 or 0xA4: increments add to the last target, not to where the shaft is",
      "等轴跟上再发，或者用 0xA3、0xA4 发绝对目标：增量加在上一个目标上，而不是加在轴的当前位置上"}},
    {AdviceKind::kJump, "jump",
     {"in a stream of changing targets, at most 50 ms apart, a step of 1° or more that needs over 1.5 times the speed that the motor or a limit allows; not while targets that were held up come in a bunch",
      "在间隔不超过 50 ms、不断变化的目标流中，有一步不小于 1°，所需速度超过电机或限值允许的 1.5 倍；被耽搁后成批到达的目标不算"},
     {"start the trajectory where the shaft is, and keep its steps within the motor's speed",
      "轨迹从轴的当前位置开始，每一步都不超过电机的速度"}},
    {AdviceKind::kMultiWithoutMode, "multi-without-mode",
     {"a command for several drives that addresses a drive whose multi-drive mode is off, or for which no drive here is in multi-drive mode",
      "多电机命令里有给某台驱动器的内容，而它没有打开广播模式；或者总线上没有任何驱动器处于广播模式"},
     {"switch multi-drive mode on (broadcast_mode = true), or command each drive by its own identifier",
      "打开广播模式（broadcast_mode = true），或者用每台驱动器自己的标识符发命令"},
     false,
     {"switch broadcast mode on (broadcast_mode = true), or command each drive by its own ID",
      "打开广播模式（broadcast_mode = true），或者用每台驱动器自己的 ID 发命令"}},
    {AdviceKind::kSingleInMultiMode, "single-in-multi-mode",
     {"10 frames for one drive to a drive in multi-drive mode, at most 1 s apart",
      "向处于广播模式的驱动器发了 10 条单电机命令，相邻两条不超过 1 s"},
     {"command this drive with 0x280 and its like, or switch multi-drive mode off with the setup software (broadcast_mode = false)",
      "用 0x280 等多电机命令控制这台驱动器，或者用配置软件关闭广播模式（broadcast_mode = false）"},
     false,
     {"command this drive with packets that begin with 02, or switch broadcast mode off with the setup software (broadcast_mode = false)",
      "用以 02 开头的数据包控制这台驱动器，或者用配置软件关闭广播模式（broadcast_mode = false）"}},
    {AdviceKind::kErrorIgnored, "error-ignored",
     {"10 queries to a drive with an error, from 2 s after it on, and none of them 0x9A, 0x9B, 0x80 or 0x88 since; or none at all for 5 s, after 2 s without a pause of 1 s and without 0x9A or 0x9B",
      "驱动器出错 2 s 之后仍在发命令帧，已有 10 条，其间没有 0x9A、0x9B、0x80 或 0x88；或者出错时还在通信，停顿都不超过 1 s，2 s 内没有 0x9A 或 0x9B，然后 5 s 没有任何命令帧"},
     {"read state 1 (0x9A) regularly: no other reply reports errors",
      "要不时读取状态 1（0x9A）：其他回复都不带错误标志"}},
    {AdviceKind::kDuplicateId, "duplicate-id",
     {"8 frames, 4 ms apart at most, with a temperature from −40 °C, 2 °C apart at most, where a query has 0 or a direction (not −1, 0 or 1 °C), or with values where a query to read has 0; only where queries with this command had that before, and not counting frames whose bytes there are those of one of the last 16 replies on the bus; where a query has a direction, only frames whose DATA[7] no target has; or a frame for an ID that two drives here answer at",
      "8 帧，相邻不超过 4 ms，在命令帧该为 0 或转向的位置上是 −40 °C 以上的温度（−1、0、1 °C 除外），前后相差不超过 2 °C，或者在读取命令该为 0 的位置上有值；此前同一命令在该处须确实如此，该处各字节与总线上最近 16 个回复之一相同的帧不计；命令带转向时，只算 DATA[7] 不可能属于目标的帧；或者这里有两台驱动器都回复该 ID"},
     {"give every drive on the bus an ID of its own: other --ids here, or take the other drive or emulator off the bus",
      "让总线上每台驱动器的 ID 各不相同：在这里换用别的 --ids，或者把另一台驱动器（仿真器）从总线上移走"}},
    {AdviceKind::kUnknownCommand, "unknown-command",
     {"a command or parameter that the drive does not have: no answer; once for each of them, and once for all commands of MyActuator drives",
      "驱动器没有的命令或参数：没有回复；每种第一次出现时给出，MyActuator 驱动器的命令合并为一条"},
     {"use commands that the drive has, or give it the switch or the generation that has them (docs/reference/protocol.md, section 10)",
      "使用驱动器有的命令，或者为它打开相应的开关、选用有这些命令的固件代（docs/zh-CN/reference/protocol.md 第 10 节）"},
     true},
    {AdviceKind::kTrustsClearReply, "trusts-clear-reply",
     {"0x9B three times within 5 s to a drive whose reply shows the errors from before, no 0x9A in between, and no error left since the first",
      "5 s 内向回复给出清除前标志的驱动器发了三次 0x9B，其间没有 0x9A，而从第一次起就已没有错误"},
     {"read 0x9A after 0x9B, and decide on that",
      "0x9B 之后再读 0x9A，按它的回复判断"}},
    {AdviceKind::kPollsDead, "polls-dead",
     {"20 queries in a row and 2 s without an answer, at most 500 ms apart, between queries to other drives",
      "连续 20 条命令帧、历时 2 s 没有回复，相邻不超过 500 ms，其间还在与其他驱动器通信"},
     {"back off to one query a second: each one costs the time-out, for all drives",
      "降到每秒一次：每一次都要等到超时，拖慢所有驱动器"}},
    {AdviceKind::kTimeoutBelowLatency, "timeout-below-latency",
     {"10 times the next query to the drive before the reply to the last could come through the hosts' adapter, and the reply came",
      "有 10 次，上一条的回复还来不及经过主机的适配器到达，就给这台驱动器发了下一条命令帧，而回复后来到了"},
     {"wait at least three times the worst round trip before a reply counts as lost",
      "至少等最坏往返时间的三倍，才算回复丢失"}},
    {AdviceKind::kLunge, "lunge",
     {"a motion of more than 5° (output) that begins after a start, 0x80, 0x81, an error, a fault or a silence of the host for 5 of its periods, before the host has received an angle: 0x90, 0x92, 0x94, or a state with the encoder; a motion by speed, torque or power only up to the first angle",
      "启动、0x80、0x81、出错、注入故障或主机静默超过自身 5 个周期之后，主机还没有收到角度（0x90、0x92、0x94 或带编码器的状态），输出轴就转了 5° 以上；速度、转矩或功率命令的运动只算到收到第一个角度为止"},
     {"read the angle after each of these events, and start the motion there",
      "每次发生这些事件之后先读角度，再从该角度开始运动"}},
    {AdviceKind::kParameterSpace, "parameter-space",
     {"0x42 with a number of 0xC0 and 0xC1 (0x0A to 0x0C, 0x1E to 0x26), or these with one of 0x40 and 0x42 (0x05, 0x96 to 0x9E, 0xE0 to 0xEC)",
      "0x42 带 0xC0、0xC1 的编号（0x0A 至 0x0C、0x1E 至 0x26），或者 0xC0、0xC1 带 0x40、0x42 的编号（0x05、0x96 至 0x9E、0xE0 至 0xEC）"},
     {"two tables share numbers, and the command byte says which is meant: 0xC0 and 0xC1 are for control parameters, 0x40 and 0x42 for settings",
      "两张表共用编号，由命令字节区分：0xC0、0xC1 是控制参数，0x40、0x42 是设置"}},
    {AdviceKind::kSettingNotSaved, "setting-not-saved",
     {"a setting was written with 0x42 and the drive restarted, by 0x07 or without power, and no 0x44 has saved it",
      "用 0x42 写了设置，驱动器随后重启（0x07 或断电），其间没有 0x44 保存"},
     {"save with 0x44, then restart",
      "先用 0x44 保存，再重启"}},
    {AdviceKind::kTtyNotRaw, "tty-not-raw",
     {"RS-485: the host's terminal has ICRNL, INLCR, IGNCR, ISTRIP, IXON, OPOST or ECHO set at a request",
      "RS-485：主机发命令帧时，终端还设着 ICRNL、INLCR、IGNCR、ISTRIP、IXON、OPOST 或 ECHO"},
     {"make the port raw after opening it, with cfmakeraw",
      "打开串口之后用 cfmakeraw 设为原始模式"},
     true},
    {AdviceKind::kZeroWithoutPayload, "zero-without-payload",
     {"RS-485: 0x95 with LEN 0 to a drive whose 0x95 has seven bytes",
      "RS-485：向 0x95 带七个字节的驱动器发了 LEN 为 0 的 0x95"},
     {"send 0x95 with LEN 7 and zeros; without them the turn count takes any value",
      "0x95 的 LEN 用 7，数据全 0；不带数据，圈数会变成任意值"}},
    {AdviceKind::kCanPadding, "can-padding",
     {"RS-485: LEN 7, as on CAN, of 0x80, 0x81, 0x88, 0x8C, 0x92, 0x94, 0x9A to 0x9D, or 0xA5 to 0xA8",
      "RS-485：0x80、0x81、0x88、0x8C、0x92、0x94、0x9A 至 0x9D 或 0xA5 至 0xA8 的 LEN 为 7，与 CAN 一样"},
     {"RS-485 has payloads of its own (docs/reference/rs485.md, Commands)",
      "RS-485 的数据长度与 CAN 不同（docs/reference/rs485.md 的 Commands 一节）"}},
    {AdviceKind::kTalksOverReply, "talks-over-reply",
     {"RS-485: 3 times a packet that begins before the reply to the last can have ended, unless the drive hears it before it replies",
      "RS-485：有 3 次在上一条的回复还不可能发完时就开始发下一条，驱动器在回复之前收得到的除外"},
     {"read the reply to each command, to those that move the drive too, or wait until it is over",
      "每条命令都要读回复，运动命令也一样，或者等回复发完"}},
    {AdviceKind::kEchoTaken, "echo-taken",
     {"RS-485, where hosts read what they send: 3 times the next packet after that, before the reply to the last can have ended",
      "RS-485，主机会读到自己发出的字节：有 3 次读完它们、回复还不可能发完，就发了下一条"},
     {"drop as many bytes as were sent, and read the reply after them: its bytes may be the same",
      "按发出的字节数丢掉回波，再读后面的回复：两者内容可能相同"}},
    {AdviceKind::kSumWrong, "sum-wrong",
     {"RS-485: 3 packets whose sums are wrong in one and the same way: the remainder by 255; the header counted in that of the data",
      "RS-485：3 个数据包的校验和以同一种方式出错：取了对 255 的余数；数据的校验和把帧头也算了进去"},
     {"a sum is the low byte, & 0xFF, of the sum of the four bytes of the header, or of the data alone",
      "校验和是和的低字节（& 0xFF）：帧头的四个字节之和，或者只是数据之和"},
     true},
    {AdviceKind::kCalibrationUnderLoad, "calibration-under-load",
     {"0x18 turns a shaft that carries more than a fifth of the rated torque, on average over the run",
      "0x18 转动的轴上带着负载，整个过程的平均值超过额定转矩的五分之一"},
     {"remove the load before a calibration, or do not calibrate: the shaft turns back and forth, and the result is wrong",
      "校准之前先卸下负载，否则不要校准：轴会来回转动，得到的结果也不对"}},
    {AdviceKind::kLeftTurning, "left-turning",
     {"the host is silent for 5 of its periods and 1 s more while a speed, torque or power command turns the drive, and the lost-input protection of the drive is off",
      "主机静默超过自身 5 个周期，再过 1 s，速度、转矩或功率命令仍使驱动器转动，而输入丢失保护没有打开"},
     {"switch the lost-input protection on, and send 0x80 or 0x81 before the host ends",
      "打开输入丢失保护，并在主机程序结束前发 0x80 或 0x81"}},
    {AdviceKind::kFirstTargetZero, "first-target-zero",
     {"the first 0xA3 or 0xA4 after a start, 0x80, 0x81, an error, a fault or a silence of the host for 5 of its periods is exactly 0, and more than 5° (output) away",
      "启动、0x80、0x81、出错、注入故障或主机静默超过自身 5 个周期之后，第一条 0xA3 或 0xA4 的目标恰好是 0，而离当前位置 5°（输出端）以上"},
     {"set the first target to the angle that 0x92 reads: a variable without a value may be 0",
      "第一个目标用 0x92 读到的角度：没有赋值的变量可能是 0"}},
    {AdviceKind::kTargetWrapped, "target-wrapped",
     {"a target of 0xA3 or 0xA4 that differs from the angle of the shaft by 2³² · 0.01°, within one turn of the output",
      "0xA3 或 0xA4 的目标与轴的角度相差 2³² · 0.01°，误差在输出端一圈以内"},
     {"keep targets from −2³¹ to 2³¹ − 1, in 0.01°, and set a new zero before the angle gets there",
      "目标保持在 −2³¹ 到 2³¹ − 1（单位 0.01°）之内，角度接近界限前重新设零"}},
    {AdviceKind::kAnswersShifted, "answers-shifted",
     {"after a late reply: 10 queries in a row, each sent after the reply to the query before the last one, and before the reply to the last one",
      "一个回复迟到之后，连续 10 条命令帧都在收到上上条的回复之后、收到上一条的回复之前发出"},
     {"discard received frames before each query, and compare DATA[0] of the reply with the query",
      "每次发命令帧之前清空已收到的帧，并核对回复与命令帧的 DATA[0]"}},
    {AdviceKind::kStaleBacklog, "stale-backlog",
     {"2 motion commands, or more, that waited more than 100 ms for an acknowledgement; one alone may have been on the wire when the last drive went away",
      "有 2 条以上的运动命令等待应答超过 100 ms 之后才发出；只有一条时，可能是最后一台驱动器离开时正在线上的那条"},
     {"send no motion while replies are missing, and clear the send queue before the power returns (ip link set down and up)",
      "收不到回复时不发运动命令，并在恢复供电前清空发送队列（把接口 down 再 up）"}},
}};
// clang-format on
static_assert(std::ranges::all_of(kTable, [](const AdviceRow& row) {
  return &row - kTable.data() == static_cast<std::ptrdiff_t>(row.kind) && !row.todo.zh.empty();
}));

}  // namespace

std::span<const AdviceRow> advice_table() { return kTable; }

const AdviceRow& advice_row(AdviceKind kind) { return kTable[static_cast<std::size_t>(kind)]; }

namespace {

/// Names of the generations that have the command: "legacy, late-legacy".
std::string generations_with(const protocol::CommandInfo* command, protocol::Framing framing) {
  std::vector<std::string> names;
  for (const protocol::GenerationRow& row : protocol::kGenerationRows) {
    if (command != nullptr && has(row, *command, framing)) names.emplace_back(row.name);
  }
  return comma_list(names);
}

/// Fills in {1}, {2}, {3}, {command}, {name}, {key}, {generations} and {event}.
std::string filled(const BilingualText& text, Language language, const Finding& found,
                   protocol::Framing framing) {
  const std::string_view pattern = text.in(language);
  const std::uint8_t byte = found.command.value_or(0);
  const protocol::CommandInfo* const command = protocol::find_command(byte, framing);
  const auto& numbers = found.numbers;
  return fmt::format(fmt::runtime(pattern), "", number_text(numbers[0]), number_text(numbers[1]),
                     number_text(numbers[2]), fmt::arg("command", fmt::format("0x{:02X}", byte)),
                     fmt::arg("name", command != nullptr ? command->name : ""),
                     fmt::arg("key", command != nullptr ? command->when.words : ""),
                     fmt::arg("generations", generations_with(command, framing)),
                     fmt::arg("event", found.event != nullptr ? found.event->in(language) : ""));
}

/// Placeholders: kind, problem, count, plural "s" (English only), frame, time, remedy.
constexpr BilingualText kLine{": {}: {} ({} time{}, first {} at {} s): {}",
                              ": {}: {}（{} 次{:.0}，首次 {}，{} s）：{}"};

}  // namespace

bool has(const protocol::GenerationRow& row, const protocol::CommandInfo& command,
         protocol::Framing framing) {
  const bool serial = framing == protocol::Framing::kSerial;
  return command.when.on(protocol::wire_format(serial ? row.serial : row.dialect, Series::kMf));
}

bool same_cause(const Finding& one, const Finding& other) {
  return one.kind == other.kind && (!advice_row(one.kind).is_per_cause ||
                                    (one.what == other.what && one.command == other.command));
}

std::string what_text(const Advice& advice, Language language) {
  return filled(*advice.found.what, language, advice.found, protocol::framing_of(advice.frame));
}

std::string todo_text(const Advice& advice, Language language) {
  const Finding& found = advice.found;
  const auto framing = protocol::framing_of(advice.frame);
  const AdviceRow& row = advice_row(found.kind);
  const bool own = framing == protocol::Framing::kSerial && !row.serial_todo.en.empty();
  const BilingualText& todo = found.todo != nullptr ? *found.todo
                              : own                 ? row.serial_todo
                                                    : row.todo;
  return filled(todo, language, found, framing);
}

std::string advice_line(const std::string& bus, const Advice& advice, Language language) {
  std::string text = bus;
  if (advice.id != 0) text += ":" + std::to_string(advice.id);
  return text + fmt::format(fmt::runtime(kLine.in(language)), advice_row(advice.found.kind).word,
                            what_text(advice, language), advice.count, advice.count == 1 ? "" : "s",
                            frame_text(advice.frame), number_text(in_seconds(advice.first)),
                            todo_text(advice, language));
}

bool AdviceLog::has_room(int id, AdviceKind kind) const {
  const auto causes = std::ranges::count_if(
      all_, [&](const Advice& advice) { return advice.id == id && advice.found.kind == kind; });
  return all_.size() < kMax && static_cast<std::size_t>(causes) < kMaxCauses;
}

void AdviceLog::note(int id, const Finding& finding, const Suspect& suspect, std::uint64_t times) {
  Mark& mark = marks_[suspect.number % kMarks];
  if (mark.number != suspect.number) mark = {suspect.number, finding.kind};
  const auto known = std::ranges::find_if(all_, [&](const Advice& advice) {
    return advice.id == id && same_cause(advice.found, finding);
  });
  if (known == all_.end()) {
    if (!has_room(id, finding.kind)) {
      left_out_ += times;
      return;
    }
    all_.push_back({finding, id, times, suspect.at, suspect.frame});
    return;
  }
  known->count += times;
  if (finding.replaces_numbers) known->found = finding;
}

std::string_view AdviceLog::mark_of(std::uint64_t number) const {
  const Mark& mark = marks_[number % kMarks];
  return number != 0 && mark.number == number ? advice_row(mark.kind).word : std::string_view();
}

}  // namespace lk::emulator
