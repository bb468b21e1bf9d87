// Faults of the adapter between hosts and bus, which add times to the configured times.
// Faults of RS-485 only: replies with a wrong checksum, a missing byte or a pause. Also effects
// that serial ports and their drivers have on hosts.

#include <algorithm>
#include <cmath>
#include <utility>

#include "emulator/core/bus/host_adapter.hpp"
#include "emulator/core/faults/acts.hpp"
#include "emulator/core/faults/fault_rows.hpp"
#include "emulator/core/wire_timing.hpp"
#include "protocol/serial_framing.hpp"

namespace lk::emulator {
namespace {

using enum FaultGroup;

constexpr std::string_view kNoYes[] = {"no", "yes"};
enum class Answer : std::uint8_t { kNo, kYes };

void add_latency(const LiveFault& live, AdapterTimes& sum) {
  sum = add(sum, {.tx_us = live.number(0),
                  .rx_us = live.number(1),
                  .jitter_us = live.number(2),
                  .tail_us = live.number(3),
                  .tail_probability = live.number(4)});
}

void add_batch(const LiveFault& live, AdapterTimes& sum) {
  sum = add(sum,
            {.batch_us = live.number(0), .batch_most = static_cast<std::size_t>(live.number(1))});
}

void add_overrun(const LiveFault& live, AdapterTimes& sum) {
  sum = add(sum, {.depth = static_cast<std::size_t>(live.number(0)),
                  .reports_overrun = live.choice<Answer>(1) == Answer::kYes,
                  .tx_depth = static_cast<std::size_t>(live.number(2))});
}

void add_stalls(const LiveFault& live, AdapterTimes& sum) {
  sum =
      add(sum, {.stall_every = static_cast<int>(live.number(0)), .stall_us = live.number(1) * 1e3});
}

HostCut cut_cable(const LiveFault&) { return HostCut::kCable; }
HostCut go_off(const LiveFault&) { return HostCut::kOff; }
HostCut unplug(const LiveFault& live) {
  return live.choice<Answer>(0) == Answer::kYes ? HostCut::kMoved : HostCut::kGone;
}

// Row: word, group and parameters, functions; description.
// clang-format off
constexpr FaultRow kAdapterRows[] = {
    {.word = "adapter_latency", .group = kLink, .params = {needed("tx_us", 0, 1'000'000), needed("rx_us", 0, 1'000'000), number("jitter_us", 0, 1'000'000, 0), number("tail_us", 0, 1'000'000, 0), number("tail_probability", 0, 1, 0)},
     .of_bus = true, .adapter = add_latency, .adapter_shows = &AdapterEffects::late,
     .about = {"the hosts' adapter delays frames to the wire and to the host by this time, plus or minus the jitter, and sometimes plus the tail", "主机的适配器到总线、到主机各要这么久，上下浮动不超过 jitter，偶尔再加上 tail"}},
    {.word = "adapter_batch", .group = kLink, .params = {number("every_us", 1, 1'000'000, 1000), count("most", 1, 1024, 64)},
     .of_bus = true, .adapter = add_batch, .adapter_shows = &AdapterEffects::batched,
     .about = {"frames reach the host in batches with one time stamp: at multiples of this time, or when this number of frames waits", "帧成批到达主机：在这一时间的整数倍，或等待的达到这么多时；时间戳相同"}},
    {.word = "adapter_overrun", .group = kLink, .params = {count("depth", 1, 1024, 32), choice("flag", kNoYes, Answer::kYes), count("tx_depth", 0, 4096, 0)},
     .of_bus = true, .adapter = add_overrun, .adapter_shows = &AdapterEffects::lost,
     .about = {"the adapter holds at most this number of frames for the host; newer ones are lost, and with the flag an error frame (RX overflow) reports it; on CAN it also takes at most tx_depth frames of the host (0: its queue)", "适配器里最多有这么多帧等待主机；再来的丢掉，flag 为 yes 时有一个错误帧（RX overflow）说明；CAN 上主机的帧也至多收 tx_depth 个（0：队列的大小）"}},
    {.word = "write_stalls", .group = kLink, .params = {count("every", 1, 1000, 2), number("stall_ms", 0.01, 10'000, 5200)},
     .of_bus = true, .adapter = add_stalls, .adapter_shows = &AdapterEffects::stalled,
     .about = {"after 10 ms without a reply, one in this number of writes of the host blocks for this time; later writes queue behind it", "10 ms 没有驱动器应答时，主机每这么多次写就有一次阻塞这么久；其间写的排在后面"}},
    {.word = "no_ack", .group = kLink, .of_bus = true, .can = true, .cut = cut_cable,
     .about = {"the cable is cut at the host: nothing acknowledges its frames, so its controller repeats the first one and later ones queue up; the host receives nothing; afterwards all queued frames are sent", "主机一侧的线缆断开：没有节点应答主机的帧，控制器不停重发第一帧，后面的帧排队；主机也收不到任何帧；恢复后排队的帧全部发出"}},
    {.word = "host_bus_off", .group = kLink, .of_bus = true, .can = true, .cut = go_off,
     .about = {"the host's controller is off the bus for this time (restart-ms), or until the fault is cleared (interface down and up): queued and new frames are lost, and nothing is received; error frames report bus-off and restart", "主机的控制器在这段时间内（restart-ms）脱离总线，或直到故障清除（接口 down 再 up）：排队的帧和新的帧都丢失，什么也收不到；错误帧报告 bus-off 和重启"}},
    {.word = "adapter_gone", .group = kLink, .params = {choice("renamed", kNoYes, Answer::kNo)}, .of_bus = true, .can = true, .cut = unplug,
     .about = {"the hosts' adapter is unplugged: TCP connections close, new ones are refused, a pseudo-terminal hangs up; a vcan stays up; queued and new frames are lost; afterwards it is back under the same name, or with renamed a pseudo-terminal under the next number", "主机的适配器被拔掉：TCP 连接断开，新的连接被拒绝，伪终端挂断，vcan 保持 up；排队的帧和新的帧都丢失；之后以同一个名字回来，renamed 为 yes 时伪终端以下一个编号回来"}},
};
// clang-format on

}  // namespace

std::span<const FaultRow> adapter_faults() { return kAdapterRows; }

using protocol::FrameKind;
using protocol::WireBytes;
using enum FaultGroup;

namespace {

enum class Sum : std::uint8_t { kHeader, kData };
constexpr std::string_view kSumWords[] = {"header", "data"};

/// Changes one of the two checksums by 1 to 255.
void spoil_sum(OnReply& on) {
  for (Outgoing& one : on.out) {
    const bool has_data = one.frame.kind == FrameKind::kSerial && one.frame.dlc > 1;
    const bool of_header = on.live.choice<Sum>(0) == Sum::kHeader;
    if (one.frame.kind != FrameKind::kSerial || (!of_header && !has_data)) continue;
    if (!on.live.hits()) continue;
    WireBytes bytes = protocol::wire_bytes(one.frame);
    std::uint8_t& sum = bytes.bytes[of_header ? protocol::kHeaderBytes - 1 : bytes.size - 1];
    sum = static_cast<std::uint8_t>(sum + 1 + static_cast<int>(on.live.draw() * 255));
    one.frame = protocol::bytes_frame(bytes.view());
    on.took_effect(one);
  }
}

void lose_byte(OnReply& on) {
  for (Outgoing& one : on.out) {
    if (!protocol::is_serial(one.frame) || one.frame.dlc == 0 || !on.live.hits()) continue;
    WireBytes bytes = protocol::wire_bytes(one.frame);
    auto* const lost = bytes.bytes.begin() + static_cast<std::ptrdiff_t>(
                                                 on.live.draw() * static_cast<double>(bytes.size));
    std::copy(lost + 1, bytes.bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size), lost);
    --bytes.size;
    one.frame = protocol::bytes_frame(bytes.view());
    on.took_effect(one);
  }
}

/// Splits the packet in two, after any byte but the last.
void pause_inside(OnReply& on) {
  std::vector<Outgoing> parts;
  for (const Outgoing& one : on.out) {
    const bool serial = protocol::is_serial(one.frame);
    const WireBytes bytes = serial ? protocol::wire_bytes(one.frame) : WireBytes{};
    if (bytes.size < 2 || !on.live.hits()) {
      parts.push_back(one);
      continue;
    }
    const auto first =
        1 + static_cast<std::size_t>(on.live.draw() * static_cast<double>(bytes.size - 1));
    Outgoing begin = one, rest = one;
    begin.frame = protocol::bytes_frame(bytes.view().first(first));
    begin.after_rom_write = 0;
    rest.frame = protocol::bytes_frame(bytes.view().subspan(first));
    rest.ready += from_ms(on.live.number(0));
    if (on.bitrate > 0) {
      rest.ready += bits_duration(kSerialBitsPerByte * static_cast<int>(first), on.bitrate);
    }
    parts.push_back(begin);
    parts.push_back(rest);
    ++on.extra;
    on.took_effect(one);
  }
  on.out = std::move(parts);
}

constexpr std::uint8_t kCarriageReturn = 0x0D;
constexpr std::uint8_t kLineFeed = 0x0A;

void turn_into_line_feeds(OnRead& on) {
  WireBytes bytes = protocol::wire_bytes(on.frame);
  const auto all = std::span(bytes.bytes).first(bytes.size);
  if (std::ranges::find(all, kCarriageReturn) == all.end()) return;
  on.took_effect();
  std::ranges::replace(all, kCarriageReturn, kLineFeed);
  on.frame = protocol::bytes_frame(all);
}

// Row: word, group and parameters, functions; description.
// clang-format off
constexpr FaultRow kSerialRows[] = {
    {.word = "checksum_bad", .group = kLink, .params = {choice("which", kSumWords, Sum::kData)}, .serial = true, .per_frame = true, .on_reply = spoil_sum,
     .about = {"the checksum of the reply's header, or of its data if any, is off by 1 to 255; the rest is right", "回复帧头的校验和（有数据时为数据的校验和）偏 1 至 255，其余都对"}},
    {.word = "byte_lost", .group = kLink, .serial = true, .per_frame = true, .on_reply = lose_byte,
     .about = {"a byte of the reply is missing", "回复里少一个字节"}},
    {.word = "byte_gap", .group = kLink, .params = {number("gap_ms", 0.01, 1000, 3)}, .serial = true, .per_frame = true, .on_reply = pause_inside,
     .about = {"the reply pauses for this time after one of its bytes: a host that reads until the line is idle gets half of it", "回复在某个字节之后停这么久：按线路空闲来断帧的主机只读到一半"}},
    {.word = "echo", .group = kLink, .of_bus = true, .serial = true, .echoes = true,
     .about = {"hosts read back what they send before the reply: for commands with an echo, dead drives seem to answer", "主机先读到自己发出的字节，然后才是回复：原样回复的命令看上去连死掉的驱动器也应答了"}},
    {.word = "cr_to_lf", .group = kLink, .of_bus = true, .serial = true, .on_read = turn_into_line_feeds,
     .about = {"hosts read 0x0A instead of each 0x0D, as from a terminal with ICRNL: one reply in a hundred has a wrong checksum", "主机读到的每个 0x0D 都成了 0x0A，如同终端没有清掉 ICRNL：约百分之一的回复校验和不对"}},
    {.word = "late_release", .group = kLink, .params = {number("late_us", 1, 100'000, 300)}, .of_bus = true, .serial = true, .line_hold_time = [](const LiveFault& live) { return from_ms(live.number(0) * 1e-3); },
     .about = {"the host's driver stays on for this time after its last byte: reply bytes that begin earlier are destroyed", "主机发完最后一个字节后，驱动电路还占线这么久：在此之前开始的回复字节都被毁掉"}},
};
// clang-format on

}  // namespace

std::span<const FaultRow> serial_faults() { return kSerialRows; }

}  // namespace lk::emulator
