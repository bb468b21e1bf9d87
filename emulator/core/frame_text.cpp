#include "emulator/core/frame_text.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>

#include "protocol/serial_framing.hpp"

namespace lk::emulator {
namespace {

constexpr std::uint32_t kErrorFlag = 0x20000000;  // in Linux's can_id, which candump prints

void add_hex(std::string& text, std::uint32_t value, int digits) {
  for (int digit = digits - 1; digit >= 0; --digit) {
    text += "0123456789ABCDEF"[value >> (4U * static_cast<unsigned>(digit)) & 0xFU];
  }
}

std::optional<std::uint32_t> hex_digit(char c) {
  if (c >= '0' && c <= '9') return static_cast<std::uint32_t>(c - '0');
  if (c >= 'a' && c <= 'f') return static_cast<std::uint32_t>(c - 'a' + 10);
  if (c >= 'A' && c <= 'F') return static_cast<std::uint32_t>(c - 'A' + 10);
  return std::nullopt;
}

/// Parses all of `text` as a hexadecimal number of at most eight digits.
std::optional<std::uint32_t> parse_hex(std::string_view text) {
  if (text.empty() || text.size() > 8) return std::nullopt;
  std::uint32_t value = 0;
  for (const char c : text) {
    const auto digit = hex_digit(c);
    if (!digit) return std::nullopt;
    value = value << 4U | *digit;
  }
  return value;
}

std::string quoted(std::string_view text) { return "\"" + std::string(text) + "\""; }

/// Returns what is wrong with the identifier; empty if it is valid.
std::string read_identifier(std::string_view text, protocol::Frame& frame) {
  const auto id = parse_hex(text);
  if (!id || (text.size() != 3 && text.size() != 8)) {
    return quoted(text) + " is not an identifier of 3 or 8 hexadecimal digits";
  }
  if (text.size() == 3 && *id > protocol::kMaxStandardId) {
    return quoted(text) + " is above 7FF; identifiers of 29 bits have 8 digits";
  }
  frame.id = *id;
  if (text.size() == 8 && (*id & kErrorFlag) != 0) {
    frame.kind = protocol::FrameKind::kError;
    frame.id = *id & protocol::kMaxExtendedId;
  } else if (text.size() == 8) {
    frame.extended = true;
    if (*id > protocol::kMaxExtendedId) return quoted(text) + " is above 1FFFFFFF";
  }
  return "";
}

std::string read_bytes(std::string_view text, protocol::Frame& frame,
                       std::size_t most = protocol::kCanBytes) {
  frame.dlc = 0;
  for (std::size_t n = 0; n < text.size();) {
    if (text[n] == '.' && frame.dlc > 0) {
      ++n;
      continue;
    }
    const auto byte = parse_hex(text.substr(n, 2));
    if (!byte || n + 2 > text.size()) {
      return quoted(text.substr(n, 2)) + " is not a byte of two hexadecimal digits";
    }
    if (frame.dlc == most) return "more than " + std::to_string(most) + " bytes of data";
    frame.data[frame.dlc++] = static_cast<std::uint8_t>(*byte);
    n += 2;
  }
  return "";
}

/// In place of an identifier, for RS-485: the bytes of a packet follow, or any other bytes.
constexpr std::string_view kSerialMark = "rs485";
std::variant<protocol::Frame, std::string> read_serial(std::string_view text) {
  protocol::Frame bytes;
  bytes.kind = protocol::FrameKind::kBytes;
  std::string problem = read_bytes(text, bytes, bytes.data.size());
  if (problem.empty() && bytes.dlc == 0) problem = "no bytes behind rs485#";
  if (!problem.empty()) return problem;
  return protocol::bytes_frame({bytes.data.data(), bytes.dlc});
}

/// Parses the text after '#'.
std::string read_content(std::string_view text, protocol::Frame& frame) {
  if (text.starts_with('#')) {
    frame.kind = protocol::FrameKind::kFd;
    frame.dlc = 0;
    return "";
  }
  if (text.starts_with('R') || text.starts_with('r')) {
    frame.kind = protocol::FrameKind::kRemote;
    frame.dlc = 0;
    if (text.size() == 1) return "";
    const auto length = parse_hex(text.substr(1));
    if (!length || *length > protocol::kCanBytes)
      return quoted(text) + " does not request 0 to 8 bytes";
    frame.dlc = static_cast<std::uint8_t>(*length);
    return "";
  }
  // Eight bytes with a DLC above 8, as candump -8 writes it: "_9" to "_F".
  if (text.size() > 2 && text[text.size() - 2] == '_') text.remove_suffix(2);
  return read_bytes(text, frame);
}

}  // namespace

std::variant<protocol::Frame, std::string> parse_frame(std::string_view text) {
  const std::size_t hash = text.find('#');
  if (hash == std::string_view::npos) {
    return quoted(text) + " is not a frame; write it like 141#9C00000000000000";
  }
  if (text.substr(0, hash) == kSerialMark) return read_serial(text.substr(hash + 1));
  protocol::Frame frame;
  std::string problem = read_identifier(text.substr(0, hash), frame);
  if (problem.empty()) problem = read_content(text.substr(hash + 1), frame);
  if (!problem.empty()) return problem;
  return frame;
}

std::string frame_text(const protocol::Frame& frame) {
  const bool error = frame.kind == protocol::FrameKind::kError;
  std::string text;
  if (protocol::is_serial(frame)) {
    text.append(kSerialMark) += '#';
    const protocol::WireBytes bytes = protocol::wire_bytes(frame);
    for (const std::uint8_t byte : bytes.view()) add_hex(text, byte, 2);
    return text;
  }
  add_hex(text, frame.id | (error ? kErrorFlag : 0U), frame.extended || error ? 8 : 3);
  text += '#';
  if (frame.kind == protocol::FrameKind::kFd) return text + '#';
  if (frame.kind == protocol::FrameKind::kRemote) return text + 'R';
  for (std::size_t n = 0; n < frame.dlc && n < protocol::kCanBytes; ++n) {
    add_hex(text, frame.data[n], 2);
  }
  return text;
}

}  // namespace lk::emulator
