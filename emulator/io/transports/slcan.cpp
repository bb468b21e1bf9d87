#include "emulator/io/transports/slcan.hpp"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "emulator/core/text.hpp"

namespace lk::emulator {
namespace {

using protocol::Frame;
using protocol::FrameKind;

constexpr const char* kOk = "\r";
constexpr const char* kBell = "\a";
constexpr std::size_t kLongestAck = 2;  // "z\r"
/// Bit rates of the command S, by digit.
constexpr std::array<std::int64_t, 9> kRates{10'000,  20'000,  50'000,  100'000,  125'000,
                                             250'000, 500'000, 800'000, 1'000'000};

std::optional<std::uint32_t> hexadecimal(std::string_view digits) {
  const auto value = number_of(digits, 16, UINT32_MAX);
  return value ? std::optional(static_cast<std::uint32_t>(*value)) : std::nullopt;
}

}  // namespace

std::optional<Frame> parse_slcan_frame(std::string_view line) {
  const std::string_view kind = line.substr(0, 1);
  if (kind.empty() || std::string_view("tTrR").find(kind) == std::string_view::npos) {
    return std::nullopt;
  }
  Frame frame;
  frame.extended = kind == "T" || kind == "R";
  frame.kind = kind == "r" || kind == "R" ? FrameKind::kRemote : FrameKind::kData;
  const std::size_t digits = frame.extended ? 8 : 3;
  if (line.size() < 2 + digits) return std::nullopt;
  const auto id = hexadecimal(line.substr(1, digits));
  const auto length = static_cast<std::uint8_t>(line[1 + digits] - '0');
  if (!id || *id > (frame.extended ? protocol::kMaxExtendedId : protocol::kMaxStandardId) ||
      length > protocol::kCanBytes) {
    return std::nullopt;
  }
  frame.id = *id;
  frame.dlc = length;
  const std::string_view data = line.substr(2 + digits);
  if (data.size() != (frame.kind == FrameKind::kRemote ? 0 : 2U * length)) return std::nullopt;
  for (std::size_t n = 0; 2 * n < data.size(); ++n) {
    const auto byte = hexadecimal(data.substr(2 * n, 2));
    if (!byte) return std::nullopt;
    frame.data[n] = static_cast<std::uint8_t>(*byte);
  }
  return frame;
}

std::string slcan_frame(const Frame& frame) {
  constexpr const char* kDigits = "0123456789ABCDEF";
  const bool remote = frame.kind == FrameKind::kRemote;
  std::string line(1, frame.extended ? (remote ? 'R' : 'T') : (remote ? 'r' : 't'));
  for (int shift = frame.extended ? 28 : 8; shift >= 0; shift -= 4) {
    line += kDigits[frame.id >> static_cast<unsigned>(shift) & 0xFU];
  }
  line += kDigits[frame.dlc];
  for (std::size_t n = 0; !remote && n < frame.dlc; ++n) {
    line += kDigits[frame.data[n] >> 4U];
    line += kDigits[frame.data[n] & 0xFU];
  }
  return line;
}

void Slcan::parse(std::span<const std::uint8_t> bytes, Time /*now*/, ParsedInput& parsed) {
  const auto refuse = [&] {
    ++parsed.malformed;
    if (acknowledges_) parsed.response += kBell;
  };
  lines_.split(
      bytes,
      [&](std::string_view line) {
        if (const auto text = answer(line, parsed)) {
          if (acknowledges_ || text->size() > kLongestAck) parsed.response += *text;
        } else {
          refuse();
        }
      },
      refuse);
}

std::optional<std::string> Slcan::answer(std::string_view line, ParsedInput& parsed) {
  while (line.starts_with('\n')) line.remove_prefix(1);  // terminals end lines with "\r\n"
  if (line.empty()) return kOk;
  switch (line.front()) {
    case 't':
    case 'T':
    case 'r':
    case 'R':
      return send(line, parsed);
    case 'O':
    case 'L':
      return open(line);
    case 'S':
    case 'Z':
    case 'M':
    case 'm':
      return set_up(line, parsed);
    default:
      break;
  }
  // Hosts often close a channel that is closed, or open one that is open: refused, as by an
  // adapter, but not counted as malformed.
  if (line == "C") return std::exchange(open_, false) ? kOk : kBell;
  if (line == "F" && open_) {
    if (wrong_rate()) flags_ |= kBusError;
    return fmt::format("F{:02X}\r", std::exchange(flags_, std::uint8_t{0}));
  }
  if (line == "V") return "V1013\r";  // hardware and software version, as of Lawicel's adapters
  if (line == "v") return "v0101\r";
  if (line == "N") return "NLKEM\r";
  return std::nullopt;
}

std::optional<std::string> Slcan::send(std::string_view line, ParsedInput& parsed) {
  const auto frame = parse_slcan_frame(line);
  if (!frame || !open_ || listens_only_) return std::nullopt;
  if (!wrong_rate() && !parsed.take(*frame)) return kBell;  // the queue is full
  return frame->extended ? "Z\r" : "z\r";
}

std::optional<std::string> Slcan::open(std::string_view line) {
  if (line.size() != 1) return std::nullopt;
  if (open_) return kBell;
  open_ = true;
  listens_only_ = line == "L";
  return kOk;
}

/// Handles commands that are allowed only while the channel is closed.
std::optional<std::string> Slcan::set_up(std::string_view line, ParsedInput& parsed) {
  if (open_) return std::nullopt;
  const std::string_view rest = line.substr(1);
  if (line.front() == 'S') return set_rate(rest, parsed);
  if (line.front() == 'Z') {
    if (rest != "0" && rest != "1") return std::nullopt;
    stamps_ = rest == "1";
    return kOk;
  }
  const auto bits = rest.size() == 8 ? hexadecimal(rest) : std::nullopt;
  if (!bits) return std::nullopt;
  (line.front() == 'M' ? code_ : mask_) = *bits;
  return kOk;
}

std::optional<std::string> Slcan::set_rate(std::string_view digit, ParsedInput& parsed) {
  if (digit.size() != 1 || digit.front() < '0' || digit.front() > '8') return std::nullopt;
  rate_ = kRates[static_cast<std::size_t>(digit.front() - '0')];
  if (wrong_rate()) {
    parsed.warning = fmt::format(
        "is at {} bit/s and the drives are at {}: neither understands the other", *rate_, bitrate_);
  }
  return kOk;
}

/// Applies the two filters of the SJA1000 (data sheet, "dual filter configuration"). The first one
/// uses the high half of code and mask. Bits for data bytes are ignored.
bool Slcan::accepts(const Frame& frame) const {
  const bool remote = frame.kind == FrameKind::kRemote;
  const std::uint32_t bits =
      frame.extended ? frame.id >> 13U : frame.id << 5U | (remote ? 0x10U : 0U);
  const std::uint32_t compared = frame.extended ? 0xFFFFU : 0xFFF0U;
  const auto passes = [&](unsigned shift) {
    return ((bits ^ code_ >> shift) & ~(mask_ >> shift) & compared) == 0;
  };
  return passes(16) || passes(0);
}

void Slcan::encode(const Frame& frame, Time now, std::string& out) {
  if (frame.kind == FrameKind::kError) flags_ |= kBusError;
  const bool can = frame.kind == FrameKind::kData || frame.kind == FrameKind::kRemote;
  if (!open_ || !can || wrong_rate() || !accepts(frame)) return;
  out += slcan_frame(frame);
  constexpr int kStampPeriod_ms = 60'000;
  if (stamps_) {
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
    out += fmt::format("{:04X}", ms % kStampPeriod_ms);
  }
  out += '\r';
}

}  // namespace lk::emulator
