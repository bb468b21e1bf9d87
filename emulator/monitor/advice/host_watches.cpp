#include "emulator/monitor/advice/host_watches.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "protocol/codec.hpp"
#include "protocol/wire.hpp"

namespace lk::emulator {
namespace {

using protocol::Opcode;

// clang-format off
constexpr BilingualText kBetween{"{1} comes between commands of {2}, which keep their own rhythm, and not for the first time: two programs command this drive",
                         "{2} 的命令保持自己的节奏，其间却夹着 {1}，而且不止一次：有两个程序在指挥这台驱动器"};
constexpr BilingualText kKinds{"commands of two kinds, each in its own rhythm, again and again: two programs command this drive",
                       "两种命令各按自己的节奏反复出现：有两个程序在指挥这台驱动器"};
// clang-format on

constexpr double kNoticeable = 5;  // dps or degrees; a smaller difference may be noise (assumed)

/// Returns true for commands whose values one controller alone may alternate: bang-bang, dither,
/// sensor noise.
bool is_force(Opcode opcode) {
  return opcode == protocol::Torque::kOpcode || opcode == protocol::OpenLoop::kOpcode;
}

/// Difference between the longest and the shortest gap between frames.
class Spread {
 public:
  void add(SimTime gap) {
    least_ = std::min(least_, gap);
    most_ = std::max(most_, gap);
  }
  SimTime value() const { return most_ - least_; }
  SimTime most() const { return most_; }

 private:
  SimTime least_ = SimTime::max();
  SimTime most_{0};
};

}  // namespace

/// Returns true if the commands are of one kind and similar in value. Similar: they differ by at
/// most a tenth of the step between the last two commands, or that step is between two kinds.
bool HostsWatch::alike(const MotionCommand& one, const MotionCommand& other) const {
  if (one.opcode != other.opcode) return false;
  if (recent(0).motion.opcode != recent(1).motion.opcode) return true;  // different kinds suffice
  const double way = std::abs(recent(1).motion.value - recent(0).motion.value);
  return std::abs(one.value - other.value) <= way / 10;
}

/// Returns true if the last two commands differ so much that two hosts may have sent them.
bool HostsWatch::apart() const {
  const MotionCommand& now = recent(0).motion;
  const MotionCommand& there = recent(1).motion;
  if (now.opcode != there.opcode) return true;
  // Increments do not show which position a host wants.
  return !now.increment() && !is_force(now.opcode) &&
         std::abs(there.value - now.value) >= kNoticeable;
}

/// Compares the gaps between frames that are like the last one with the gaps between all frames.
HostsWatch::Sign HostsWatch::sign() const {
  if (!apart()) return Sign::kNone;
  Spread own;  // of frames like the last one
  Spread all;
  std::size_t last = 0;
  std::size_t found = 1;
  const std::size_t kept = std::min(count_, kKept);
  for (std::size_t n = 1; n < kept && found < kRhythm; ++n) {
    all.add(recent(n - 1).at - recent(n).at);
    if (!alike(recent(n).motion, recent(last).motion)) continue;
    own.add(recent(last).at - recent(n).at);
    if (own.most() > kThereAndBack) return Sign::kNone;
    last = n;
    ++found;
  }
  if (found < kRhythm) return Sign::kNone;
  const SimTime mean = (recent(0).at - recent(last).at) / static_cast<std::int64_t>(last);
  if (all.value() * 5 < mean) return Sign::kNone;  // even gaps: one host, or two in turns
  if (own.value() * 4 > all.value()) return Sign::kOneHost;
  // A frame close to another proves nothing: delayed frames leave together, whatever their kind.
  std::size_t before = 2;
  while (!alike(recent(before).motion, recent(0).motion)) ++before;
  const SimTime gap = recent(0).at - recent(before).at;
  const SimTime nearest =
      std::min(recent(0).at - recent(1).at, recent(before - 1).at - recent(before).at);
  return nearest * 7 < gap ? Sign::kNone : Sign::kSeveral;
}

std::optional<Finding> HostsWatch::on_query(const DecodedQuery& query) {
  if (!query.motion) return std::nullopt;
  commands_[count_++ % kKept] = {query.at, *query.motion};
  if (count_ < 2) return std::nullopt;
  const Sign sign = this->sign();
  if (sign == Sign::kOneHost) times_ = std::max(times_ - 1, 0);
  if (sign != Sign::kSeveral) return std::nullopt;
  times_ = query.at - last_time_ <= kAgain ? std::min(times_ + 1, kTimes) : 1;
  last_time_ = query.at;
  if (times_ < kTimes) return std::nullopt;
  if (recent(0).motion.opcode != recent(1).motion.opcode) {
    return finding(AdviceKind::kSeveralHosts, kKinds);
  }
  return finding(AdviceKind::kSeveralHosts, kBetween, recent(1).motion.value,
                 recent(0).motion.value);
}

namespace {

using protocol::Opcode;

// clang-format off
constexpr BilingualText kReply{"{1} °C where a query has 0: the reply of another drive with this ID; the two answer each other's replies",
                       "命令帧该为 0 的位置是 {1} °C：这是另一台同 ID 驱动器的回复，两台驱动器会互相回复"};
constexpr BilingualText kReadReply{"a value where a query has 0: the reply of another drive with this ID; the two answer each other's replies",
                           "命令帧该为 0 的位置有数值：这是另一台同 ID 驱动器的回复，两台驱动器会互相回复"};
// clang-format on

/// A command whose reply has a temperature or values. In masks, bit n stands for DATA[n].
struct Row {
  Opcode command;
  unsigned unused;           // bytes that are 0 in a query; with a max speed only DATA[1]
  unsigned steady = 0;       // bytes of a reply without temperature that stay constant for 4 ms
  bool single_turn = false;  // the query has a direction in DATA[1], a target in DATA[4:7]
};
constexpr unsigned kAll = 0b1111'1110;
constexpr unsigned kTemperature = 0b0000'0010;
constexpr std::array kRows = std::to_array<Row>({
    {protocol::ReadState1::kOpcode, kAll},
    {protocol::ClearErrors::kOpcode, kAll},
    {protocol::ReadState2::kOpcode, kAll},
    {protocol::ReadState3::kOpcode, kAll},
    {protocol::OpenLoop::kOpcode, 0b1100'1110},
    {protocol::Torque::kOpcode, 0b1100'1110},
    {protocol::Speed::kOpcode, 0b0000'1110},
    {protocol::Position1::kOpcode, 0b0000'1110},
    {protocol::Position2::kOpcode, kTemperature},
    {protocol::Position3::kOpcode, 0b0000'1110, 0, true},
    {protocol::Position4::kOpcode, kTemperature, 0, true},
    {protocol::Position5::kOpcode, 0b0000'1110},
    {protocol::Position6::kOpcode, kTemperature},
    {protocol::ReadPid::kOpcode, kAll, kAll},
    {protocol::ReadAcceleration::kOpcode, kAll, kAll},
    {protocol::ReadEncoder::kOpcode, kAll, 0b1100'0010},
    {protocol::ReadMultiTurnAngle::kOpcode, kAll, 0b1111'0000},
    {protocol::ReadSingleTurnAngle::kOpcode, kAll, 0b0000'1110},
});

/// Returns true for a possible drive temperature. Excludes 0 and 1, which queries have in this
/// byte, and −1, which may be a stray 0xFF.
bool is_temperature(int C) { return (C > 1 || C < -1) && C >= -40; }

bool same(const protocol::Payload& a, const protocol::Payload& b, unsigned mask) {
  for (std::size_t n = 0; n < protocol::kCanBytes; ++n) {
    if ((mask >> n & 1U) != 0 && a[n] != b[n]) return false;
  }
  return true;
}

int temperature_C(const protocol::Payload& data) { return static_cast<std::int8_t>(data[1]); }

/// Returns true for a query as sent by a host that clears its buffer.
bool is_clear(const protocol::Payload& data, const Row& row) {
  if (row.steady != 0) return same(data, {}, kAll);
  return data[1] == 0 || data[1] == 1;
}

/// Returns true if DATA[7] is that of a single-turn target: 0 in a target of up to one output turn,
/// 0xFF in a negative one. In a reply, DATA[7] is the high byte of the encoder.
bool ends_as_target(const protocol::Payload& data) { return data[7] == 0 || data[7] == 0xFF; }

bool may_be_reply(const protocol::Payload& data, const Row& row) {
  if (row.single_turn && ends_as_target(data)) return false;
  return row.steady != 0 ? !is_clear(data, row) : is_temperature(temperature_C(data));
}

}  // namespace

bool RecentFrames::have(const protocol::Payload& data, unsigned mask) const {
  return std::ranges::any_of(kept_,
                             [&](const protocol::Payload& kept) { return same(kept, data, mask); });
}

int DuplicateWatch::Streak::add(const TimedFrame& in, bool alike) {
  times = alike && in.at - at <= kApart ? std::min(times + 1, kTimes) : 1;
  at = in.at;
  data = in.frame.data;
  return times;
}

std::optional<Finding> DuplicateWatch::on_query(const TimedFrame& in, const RecentFrames& recent) {
  const protocol::Payload& data = in.frame.data;
  const auto row = std::ranges::find(kRows, static_cast<Opcode>(data[0]), &Row::command);
  if (row == kRows.end()) return std::nullopt;
  const std::uint32_t bit = 1U << (row - kRows.begin());
  if (is_clear(data, *row)) asked_ |= bit;
  if (!may_be_reply(data, *row) || (asked_ & bit) == 0 || recent.have(data, row->unused)) {
    return std::nullopt;
  }
  if (row->steady != 0) {
    const bool alike = data[0] == reads_.data[0] && same(data, reads_.data, row->steady);
    if (reads_.add(in, alike) < kTimes) return std::nullopt;
    return finding(AdviceKind::kDuplicateId, kReadReply);
  }
  const int now_C = temperature_C(data);
  const bool alike = std::abs(now_C - temperature_C(warm_.data)) <= kSteady_C;
  if (warm_.add(in, alike) < kTimes) return std::nullopt;
  return finding(AdviceKind::kDuplicateId, kReply, now_C);
}

namespace {

using protocol::get_le;

// clang-format off
constexpr BilingualText kLacks{"{command}, {name}: no answer, this drive does not have the command; it is one of {generations}",
                       "{command} 没有回复：这台驱动器没有这条命令，有它的固件代是 {generations}"};
constexpr BilingualText kGiveIt{"if the real drive has it, set {key} in its quirks, or choose a generation that has it; if not, do without",
                        "如果真实驱动器有这条命令，就在 quirks 里设 {key}，或者选用有它的固件代；没有就不要用"};
constexpr BilingualText kNoneHas{"{command}, {name}: no answer, this drive does not have the command, and no generation has it by default",
                         "{command} 没有回复：这台驱动器没有这条命令，各固件代默认也都没有"};
constexpr BilingualText kSetItsQuirk{"if the real drive has it, set {key} in its quirks; if not, do without",
                          "如果真实驱动器有这条命令，就在 quirks 里设 {key}；没有就不要用"};
constexpr BilingualText kMyActuator{"no answer, LK-TECH drives do not have this command; MyActuator drives from V3 on do, but are not emulated",
                            "没有回复：这不是瓴控驱动器的命令；MyActuator V3 起的驱动器有它，本仿真器不支持"};
constexpr BilingualText kOtherDrives{"look up which drives the host was written for (docs/start/which-drive.md)",
                             "查这个主机程序是为哪种驱动器写的（docs/zh-CN/start/which-drive.md）"};
constexpr BilingualText kSeriesLacks{"{command}, {name}: no answer, drives of this series do not have the command",
                             "{command} 没有回复：这个系列的驱动器没有这条命令"};
constexpr BilingualText kOtherSeries{"use a command of this series, or a motor of another one (--motor)",
                             "使用这个系列的命令，或者换用另一系列的电机（--motor）"};
constexpr BilingualText kNoGenerationHas{"{command}: no answer, no generation has the command",
                           "{command} 没有回复：没有哪一代有这条命令"};
constexpr BilingualText kNoParameter{"{command}, {name}: no answer, unknown parameter {1}",
                             "{command} 没有回复：没有参数 {1}"};
constexpr BilingualText kLookUp{"see the list of commands (docs/reference/protocol.md, section 3)",
                        "查有哪些命令（docs/zh-CN/reference/protocol.md 第 3 节）"};
constexpr BilingualText kLookUpPackets{"see the list of commands (docs/reference/rs485.md, Commands)",
                               "查有哪些命令（docs/reference/rs485.md 的 Commands 一节）"};
constexpr BilingualText kWideTarget{"a target of 32 bits, {1}°: this drive reads 16 bits of it, {2}°",
                            "目标是 32 位的 {1}°：这台驱动器只读其中 16 位，即 {2}°"};
constexpr BilingualText kSetAngle{"0x95 with the angle {1}°: this drive ignores it, only v236 sets its angle so",
                          "0x95 带角度 {1}°：这台驱动器不理会，只有 v236 能这样设定角度"};
constexpr BilingualText kSpeedLimit{"0xA2 with {1} where v236 has an iq limit: this drive has none, its current is not limited by it",
                            "0xA2 在 v236 放 iq 限值的位置带有 {1}：这台驱动器没有这个限值，电流不受它限制"};
// clang-format on

/// Largest plausible angle: a thousand turns (assumed); random 32-bit values are rarely smaller.
constexpr std::int32_t kMaxAngle_cdeg = 1000 * 36000;

/// Returns true for a MyActuator command ("Servo Motor Control Protocol" V4.2, from V3 on) that
/// LK-TECH lacks. Both have 0x42: DATA[1] is one of four accelerations at MyActuator, the number of
/// a setting at LK-TECH.
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
  const auto about = [&](const BilingualText& what, const BilingualText* todo, double number = 0) {
    return Finding{AdviceKind::kUnknownCommand, &what, {number}, true, todo, frame.data[0]};
  };
  if (is_of_myactuator(frame)) {  // one advice for all of these
    return Finding{AdviceKind::kUnknownCommand, &kMyActuator, {}, false, &kOtherDrives};
  }
  const protocol::Framing framing = drive.format.dialect.framing;
  const BilingualText* const look_up =
      framing == protocol::Framing::kCan ? &kLookUp : &kLookUpPackets;
  const protocol::CommandInfo* row = protocol::command_of(frame);
  if (row == nullptr) return about(kNoGenerationHas, look_up);
  if (!protocol::fits(*row, drive.format.series)) return about(kSeriesLacks, &kOtherSeries);
  if (protocol::knows(drive.format, *row)) return about(kNoParameter, look_up, frame.data[1]);
  if (!some_generation_has(*row, framing)) return about(kNoneHas, &kSetItsQuirk);
  return about(kLacks, &kGiveIt);
}

bool has_wide_target(const DecodedQuery& query, const KnownDrive& drive) {
  if (drive.format.dialect.framing != protocol::Framing::kCan) return false;  // RS-485: other bytes
  if (!query.is<protocol::Position3>() && !query.is<protocol::Position4>()) return false;
  const auto target = get_le<std::uint32_t>(query.data, 4);
  // The limit is a turn of the output: 36000 times the gear ratio.
  return !drive.format.dialect.wide_single_turn_target && target > 0xFFFF &&
         target < drive.widest_circle_cdeg;
}

std::optional<Finding> GenerationWatch::on_query(const DecodedQuery& query,
                                                 const KnownDrive& drive) {
  const protocol::Payload& data = query.data;
  const protocol::Dialect& dialect = drive.format.dialect;
  if (dialect.framing != protocol::Framing::kCan) return std::nullopt;  // RS-485: other bytes
  if (has_wide_target(query, drive)) {
    return finding(AdviceKind::kOtherGeneration, kWideTarget,
                   get_le<std::uint32_t>(data, 4) / 100.0, get_le<std::uint16_t>(data, 4) / 100.0);
  }
  if (query.is<protocol::ClearAngle>()) {
    const auto angle = get_le<std::int32_t>(data, 4);
    const bool meant = angle != 0 && angle >= -kMaxAngle_cdeg && angle <= kMaxAngle_cdeg;
    if (dialect.clear_angle == protocol::ClearAngleMeaning::kSetsAngle || !meant) {
      return std::nullopt;
    }
    return finding(AdviceKind::kOtherGeneration, kSetAngle, angle / 100.0);
  }
  if (query.is<protocol::Speed>() && !dialect.speed_iq_limit && data[0] == 0xA2) {
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
  return finding(AdviceKind::kOtherGeneration, kSpeedLimit, limit_lsb);
}

namespace {

// clang-format off
constexpr BilingualText kCleared{"0x9B for the {1}. time within {2} s: the first has cleared the errors, its reply shows those from before",
                         "{2} s 内第 {1} 次 0x9B：第一次就已清除，它的回复给出的是清除之前的标志"};
// clang-format on

}  // namespace

std::optional<Finding> ClearWatch::on_query(const DecodedQuery& query, const KnownDrive& drive) {
  if (query.is<protocol::ReadState1>()) times_ = 0;
  if (!query.is<protocol::ClearErrors>() || !drive.clear_reply_before) return std::nullopt;
  if (drive.errors != 0 || query.at - first_ > kWithin) times_ = 0;
  if (times_ == 0) {
    first_ = query.at;
    times_ = drive.errors != 0 ? 1 : 0;  // without errors the reply misleads nobody
    return std::nullopt;
  }
  if (++times_ < kTimes) return std::nullopt;
  return finding(AdviceKind::kTrustsClearReply, kCleared, times_, in_seconds(query.at - first_));
}

}  // namespace lk::emulator
