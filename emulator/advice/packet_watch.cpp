#include "emulator/advice/packet_watch.hpp"

#include <algorithm>
#include <span>

#include "protocol/command_info.hpp"
#include "protocol/serial_framing.hpp"

namespace lk::emulator {
namespace {

// clang-format off
/// By TerminalFlag.
constexpr Words kNotRaw[] = {
    {"ICRNL is set: a 0x0D in a reply arrives as 0x0A, and its sum is wrong", "设着 ICRNL：回复里的 0x0D 到主机变成 0x0A，校验和就不对"},
    {"INLCR is set: a 0x0A in a reply arrives as 0x0D, and its sum is wrong", "设着 INLCR：回复里的 0x0A 到主机变成 0x0D，校验和就不对"},
    {"IGNCR is set: a 0x0D in a reply does not arrive", "设着 IGNCR：回复里的 0x0D 到不了主机"},
    {"ISTRIP is set: bytes of replies lose their highest bit", "设着 ISTRIP：回复的每个字节都丢掉最高位"},
    {"IXON is set: a 0x13 in a reply stops what the host writes, until a 0x11", "设着 IXON：回复里的 0x13 会挡住主机的写，直到出现 0x11"},
    {"OPOST is set: a 0x0A that the host writes has a 0x0D before it on the wire", "设着 OPOST：主机写的 0x0A 在线上前面多一个 0x0D"},
    {"ECHO is set: the terminal sends replies back to the drives", "设着 ECHO：终端把回复又发回给驱动器"},
};
constexpr Words kNoPayload{"0x95 with LEN 0: the drive takes an angle that an earlier packet left in its buffer", "LEN 为 0 的 0x95：驱动器取的是先前的数据包留在缓冲里的角度"};
constexpr Words kPadding{"{command} with LEN 7, which is CAN's", "{command} 的 LEN 为 7，那是 CAN 的长度"};
constexpr Words kOver{"{1} times a packet before the reply to the last was over: this one came {2} µs after it, and the reply ends {3} µs after it at the earliest", "有 {1} 次在上一条的回复结束之前就发：这一条在 {2} µs 之后就来了，而回复最早在 {3} µs 之后结束"};
constexpr Words kEcho{"{1} times a packet right after the host's own bytes came back: {2} µs after the last, whose reply ends {3} µs after it at the earliest", "有 {1} 次读回自己的字节后马上又发：在上一条 {2} µs 之后，而它的回复最早在 {3} µs 之后结束"};
/// By rule.
constexpr Words kSums[] = {
    {"the header's sum is the remainder of a division by 255", "帧头的校验和取了对 255 的余数"},
    {"the sum of the data is the remainder of a division by 255", "数据的校验和取了对 255 的余数"},
    {"the sum of the data counts the header in", "数据的校验和把帧头也算了进去"},
};
// clang-format on

constexpr std::uint8_t kPadded[] = {0x80, 0x81, 0x88, 0x8C, 0x92, 0x94, 0x9A,
                                    0x9B, 0x9C, 0x9D, 0xA5, 0xA6, 0xA7, 0xA8};
constexpr std::uint8_t kCanDlc = 8;  // a command and LEN 7

double in_us(SimTime time) { return 1e6 * in_s(time); }

unsigned whole_sum(std::span<const std::uint8_t> bytes) {
  unsigned sum = 0;
  for (const std::uint8_t byte : bytes) sum += byte;
  return sum;
}

}  // namespace

Finding not_raw(TerminalFlag flag) {
  return Finding{AdviceKind::kTtyNotRaw, &kNotRaw[static_cast<std::size_t>(flag)]};
}

std::optional<Finding> wrong_payload(const protocol::Frame& frame, const KnownDrive& drive) {
  const std::uint8_t command = frame.data[0];
  const protocol::Dialect& dialect = drive.format.dialect;
  if (command == static_cast<std::uint8_t>(protocol::ClearAngle::kOpcode)) {
    const bool without = frame.dlc == 1 && dialect.zero_ram_command && dialect.zero_ram_len != 0;
    if (!without) return std::nullopt;
    return Finding{AdviceKind::kZeroWithoutPayload, &kNoPayload};
  }
  if (frame.dlc != kCanDlc || std::ranges::find(kPadded, command) == std::end(kPadded)) {
    return std::nullopt;
  }
  Finding finding{AdviceKind::kCanPadding, &kPadding};
  finding.command = command;
  return finding;
}

SimTime TalkWatch::end_of(const TimedFrame& in) const {
  const auto bytes = static_cast<std::int64_t>(protocol::wire_bytes(in.frame).size);
  return std::max(in.at, own_end_) + bytes * byte_time_;
}

bool TalkWatch::is_queued(const TimedFrame& in) const {
  return in.frame.id == asked_ && end_of(in) <= reply_begins_;
}

std::optional<Finding> TalkWatch::hear(const TimedFrame& in, bool echoes) {
  if (in.at >= reply_ends_) return std::nullopt;
  const bool has_read_itself = echoes && in.at >= own_end_;
  if (!has_read_itself && is_queued(in)) return std::nullopt;
  int& times = has_read_itself ? after_echo_ : over_;
  times = std::min(times + 1, kTimes);
  if (times < kTimes) return std::nullopt;
  return Finding{has_read_itself ? AdviceKind::kEchoTaken : AdviceKind::kTalksOverReply,
                 has_read_itself ? &kEcho : &kOver,
                 {double{kTimes}, in_us(in.at - sent_), in_us(reply_ends_ - sent_)}};
}

void TalkWatch::expect_reply(const TimedFrame& in, const KnownDrive& drive) {
  const bool queued = is_queued(in);
  if (drive.byte_time == SimTime{0}) return;
  if (in.at < reply_ends_ && !queued) return;  // no drive receives it then
  const protocol::CommandInfo* const command = protocol::find_command(in.frame.data[0]);
  const std::size_t query = protocol::wire_bytes(in.frame).size;
  std::size_t reply = protocol::kHeaderBytes;
  if (command != nullptr && command->echoed) reply = query;
  if (protocol::has_state(in.frame.data[0])) reply = protocol::kHeaderBytes + kCanDlc;
  const auto more = static_cast<std::int64_t>(query + reply - 2 * protocol::kHeaderBytes);
  sent_ = in.at;
  asked_ = in.frame.id;
  byte_time_ = drive.byte_time;
  own_end_ = end_of(in);
  const SimTime reply_time = static_cast<std::int64_t>(reply) * byte_time_;
  if (queued) {
    reply_ends_ += reply_time;
    return;
  }
  reply_ends_ = in.at + drive.shortest_answer + more * drive.byte_time;
  reply_begins_ = drive.hears_while_replying ? reply_ends_ - reply_time : SimTime{0};
}

std::optional<Finding> SumWatch::hear(const protocol::Frame& frame) {
  const auto bytes = std::span(frame.data).first(frame.dlc);
  if (bytes.size() < protocol::kHeaderBytes || bytes[0] != protocol::kPacketStart) {
    return std::nullopt;
  }
  const std::size_t len = bytes[3];
  if (bytes.size() != protocol::kHeaderBytes + (len > 0 ? len + 1 : 0)) return std::nullopt;
  const unsigned header = whole_sum(bytes.first(protocol::kHeaderBytes - 1));
  const bool good_header = (header & 0xFFU) == bytes[protocol::kHeaderBytes - 1];
  std::optional<std::size_t> rule;
  if (!good_header) {
    if (header % 0xFFU == bytes[protocol::kHeaderBytes - 1]) rule = 0;
  } else if (len > 0) {
    const unsigned data = whole_sum(bytes.subspan(protocol::kHeaderBytes, len));
    const std::uint8_t sum = bytes.back();
    const unsigned all = data + header;
    if (data % 0xFFU == sum) {
      rule = 1;
    } else if ((all & 0xFFU) == sum || ((all + bytes[4]) & 0xFFU) == sum) {
      rule = 2;
    }
  }
  if (!rule) return std::nullopt;
  times_[*rule] = std::min(times_[*rule] + 1, kTimes);
  if (times_[*rule] < kTimes) return std::nullopt;
  return Finding{AdviceKind::kSumWrong, &kSums[*rule]};
}

}  // namespace lk::emulator
