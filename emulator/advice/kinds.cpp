#include "emulator/advice/kinds.hpp"

#include <array>

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
     {"a motion command that is not executed because the drive is off; with an error, from 100 ms after the host has asked with 0x9A or 0x9B, else from 2 s after the error",
      "驱动器已关闭，运动命令没有执行；有错误时，从主机用 0x9A 或 0x9B 询问之后 100 ms 起算，没有询问则从出错之后 2 s 起算"},
     {"clear the error with 0x9B, switch the drive on with 0x88, then move",
      "先用 0x9B 清除错误标志，再用 0x88 运行，然后才发运动命令"}},
    {AdviceKind::kSpeedAsPosition, "speed-as-position",
     {"values of 0xA2 of 5 dps and more that are angles: three in a row, each of another size than the one before, were held for 100 ms and left when the shaft passed that angle; or they start within 0.3° of the angle the host has just read, and continue in 10 steps of at most 5 dps",
      "0xA2 的值不小于 5 dps 而实为角度：连续三个值，每个都与前一个大小不同，都保持了 100 ms，又恰在轴转过该角度时换掉；或者从主机刚读到的角度（相差不超过 0.3°）开始，接着有 10 步，每步不超过 5 dps"},
     {"send positions with 0xA3 or 0xA4: the value of 0xA2 is a speed, and the shaft turns on after it has passed the angle",
      "位置用 0xA3 或 0xA4 发送：0xA2 的值是速度，轴转过该角度后不会停下"}},
    {AdviceKind::kFieldRange, "field-range",
     {"a field beyond what the drive takes: it is clamped, or the command is not executed",
      "某个字段超出驱动器接受的范围：被限幅，或者命令不执行"},
     {"keep the field within its range (docs/protocol.md, sections 2 and 10)",
      "让该字段保持在范围之内（docs/zh-CN/protocol.md 第 2、10 节）"}},
    {AdviceKind::kOtherGeneration, "other-generation",
     {"a field where only another generation has one: 0xA5 and 0xA6 with a 32-bit target, 0x95 with an angle, 0xA2 with the same iq limit 10 times; or 3 times a command that only another generation has",
      "字段放在只有别的固件代才有的位置：0xA5、0xA6 带 32 位目标，0x95 带角度，0xA2 带同一个 iq 限值 10 次；或者只有别的固件代才有的命令出现 3 次"},
     {"use the layout of this drive's generation, or give the drive the generation that the host was written for (docs/protocol.md, section 10)",
      "按这台驱动器的固件代排列字段，或者把驱动器设为主机所针对的固件代（docs/zh-CN/protocol.md 第 10 节）"}},
    {AdviceKind::kWrongLength, "wrong-length",
     {"a frame for the drive with a DLC other than 8: it is not answered",
      "发给驱动器的帧 DLC 不是 8：没有回复"},
     {"send all frames with 8 bytes, unused ones 0",
      "所有帧都发 8 个字节，不用的字节填 0"}},
    {AdviceKind::kSeveralHosts, "several-hosts",
     {"8 times, within 1 s of each other, a motion command of another kind or value among steady ones, and back within 100 ms: now and then, or in turns",
      "平稳的运动命令之间夹着种类或数值不同的一条，100 ms 之内又变回来，偶尔如此或轮流出现，共 8 次，相邻两次不超过 1 s"},
     {"let one program command a drive; others may listen",
      "一台驱动器只由一个程序发命令，其他程序只监听"}},
    {AdviceKind::kFasterThanWire, "faster-than-wire",
     {"more than 64 frames wait for the wire, for 100 ms, or the send queue of 1024 runs over",
      "等待上线的帧超过 64 个，持续 100 ms；或者 1024 帧的发送队列溢出"},
     {"lower the rate, or send the next query when the reply has come: a query and its reply take about 0.25 ms at 1 Mbit/s",
      "降低频率，或者收到回复再发下一条命令帧：1 Mbit/s 下一条命令帧加回复约占 0.25 ms"}},
    {AdviceKind::kFasterThanDrive, "faster-than-drive",
     {"a query that the drive does not take because 16 replies wait in it already",
      "驱动器里已有 16 个回复在等待，命令帧不被接受"},
     {"wait for the reply before the next query, for that to a ROM write above all",
      "收到回复再发下一条命令帧，写 ROM 之后尤其如此"}},
    {AdviceKind::kNotWaited, "not-waited",
     {"20 queries in a row that come before the reply to the one before can have come",
      "连续 20 条命令帧，都在上一条的回复还不可能到达时就发出"},
     {"read the reply before the next query to this drive; without it, nothing says that a command was taken",
      "先读回复，再向这台驱动器发下一条命令帧；不读回复就不知道命令是否被接受"}},
    {AdviceKind::kInputWindow, "input-window",
     {"3 pauses of the host of 0.8 to 3 times the time after which lost input trips",
      "主机停顿的时间达到输入丢失保护时间的 0.8 到 3 倍，共 3 次"},
     {"send something to the drive at least twice in that time, or lengthen it",
      "在这段时间内至少向驱动器发两帧，或者把它设长"}},
    {AdviceKind::kWindUp, "wind-up",
     {"10 increments of 0xA7 or 0xA8 in one direction, for 1 s, of which the shaft is behind by more than 1 s",
      "0xA7 或 0xA8 朝同一方向给了 10 次增量，历时 1 s，而轴落后 1 s 以上"},
     {"wait until the shaft follows, or send absolute targets with 0xA3 or 0xA4: increments add to the last target, not to where the shaft is",
      "等轴跟上再发，或者用 0xA3、0xA4 发绝对目标：增量加在上一个目标上，而不是加在轴的当前位置上"}},
    {AdviceKind::kJump, "jump",
     {"in a stream of changing targets, at most 50 ms apart, a step of 1° or more that needs over 1.5 times the speed that the motor or a limit allows",
      "在间隔不超过 50 ms、不断变化的目标流中，有一步不小于 1°，所需速度超过电机或限值允许的 1.5 倍"},
     {"start the trajectory where the shaft is, and keep its steps within the motor's speed",
      "轨迹从轴的当前位置开始，每一步都不超过电机的速度"}},
    {AdviceKind::kMultiWithoutMode, "multi-without-mode",
     {"a command for several drives that has something for a drive whose multi-drive mode is off, or that no drive here is in the mode for",
      "多电机命令里有给某台驱动器的内容，而它没有打开广播模式；或者总线上没有任何驱动器处于广播模式"},
     {"switch multi-drive mode on (broadcast_mode = true), or command each drive by its own identifier",
      "打开广播模式（broadcast_mode = true），或者用每台驱动器自己的标识符发命令"}},
    {AdviceKind::kSingleInMultiMode, "single-in-multi-mode",
     {"10 frames for one drive to a drive in multi-drive mode, at most 1 s apart",
      "向处于广播模式的驱动器发了 10 条单电机命令，相邻两条不超过 1 s"},
     {"command this drive with 0x280 and its like, or switch multi-drive mode off with the setup software (broadcast_mode = false)",
      "用 0x280 等多电机命令控制这台驱动器，或者用配置软件关闭广播模式（broadcast_mode = false）"}},
    {AdviceKind::kErrorIgnored, "error-ignored",
     {"10 queries to a drive with an error, from 2 s after it on, and none of them 0x9A, 0x9B, 0x80 or 0x88 since; or none at all for 5 s, after 2 s without a pause of 1 s and without 0x9A or 0x9B",
      "驱动器出错 2 s 之后仍在发命令帧，已有 10 条，其间没有 0x9A、0x9B、0x80 或 0x88；或者出错时还在通信，停顿都不超过 1 s，2 s 内没有 0x9A 或 0x9B，然后 5 s 没有任何命令帧"},
     {"read state 1 (0x9A) every now and then: no other reply tells of errors",
      "要不时读取状态 1（0x9A）：其他回复都不带错误标志"}},
}};
// clang-format on

}  // namespace

std::span<const AdviceRow> advice_table() { return kTable; }

const AdviceRow& advice_row(AdviceKind kind) { return kTable[static_cast<std::size_t>(kind)]; }

}  // namespace lk::emulator
