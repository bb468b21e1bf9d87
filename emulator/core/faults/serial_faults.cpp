// Faults of RS-485 only: replies with a wrong checksum, a missing byte or a pause, and effects of
// serial ports and their drivers on hosts.

#include <algorithm>
#include <cmath>
#include <utility>

#include "emulator/core/faults/acts.hpp"
#include "emulator/core/faults/fault_rows.hpp"
#include "emulator/core/wire_timing.hpp"
#include "protocol/serial_framing.hpp"

namespace lk::emulator {

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
    {.word = "checksum_bad", .group = kLink, .params = {choice("which", kSumWords, Sum::kData)}, .serial = true, .per_frame = true, .say = spoil_sum,
     .about = {"the sum of the reply's header, or of its data where it has any, is off by 1 to 255, all the rest right", "回复帧头的校验和（有数据时为数据的校验和）偏 1 至 255，其余都对"}},
    {.word = "byte_lost", .group = kLink, .serial = true, .per_frame = true, .say = lose_byte,
     .about = {"a byte of the reply is missing", "回复里少一个字节"}},
    {.word = "byte_gap", .group = kLink, .params = {number("gap_ms", 0.01, 1000, 3)}, .serial = true, .per_frame = true, .say = pause_inside,
     .about = {"the reply pauses so long behind one of its bytes: who reads until the line rests has half of it", "回复在某个字节之后停这么久：按线路空闲来断帧的主机只读到一半"}},
    {.word = "echo", .group = kLink, .of_bus = true, .serial = true, .echoes = true,
     .about = {"hosts read what they send, before the reply: dead drives seem to answer what is echoed", "主机先读到自己发出的字节，然后才是回复：原样回复的命令看上去连死掉的驱动器也应答了"}},
    {.word = "cr_to_lf", .group = kLink, .of_bus = true, .serial = true, .read = turn_into_line_feeds,
     .about = {"hosts read 0x0A in place of each 0x0D, as from a terminal with ICRNL: a reply in a hundred has a wrong sum", "主机读到的每个 0x0D 都成了 0x0A，如同终端没有清掉 ICRNL：约百分之一的回复校验和不对"}},
    {.word = "late_release", .group = kLink, .params = {number("late_us", 1, 100'000, 300)}, .of_bus = true, .serial = true, .keeps_line = [](const LiveFault& live) { return from_ms(live.number(0) * 1e-3); },
     .about = {"the host's driver stays on so long behind its last byte: bytes of replies that begin before are spoiled", "主机发完最后一个字节后，驱动电路还占线这么久：在此之前开始的回复字节都被毁掉"}},
};
// clang-format on

}  // namespace

std::span<const FaultRow> serial_faults() { return kSerialRows; }

}  // namespace lk::emulator
