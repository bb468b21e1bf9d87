#include "emulator/frame_text.hpp"

#include <cstdint>

namespace lk::emulator {
namespace {

constexpr std::uint32_t kErrorFlag = 0x20000000;  // of Linux's can_id, which candump prints

void add_hex(std::string& text, std::uint32_t value, int digits) {
  for (int digit = digits - 1; digit >= 0; --digit) {
    text += "0123456789ABCDEF"[value >> (4U * static_cast<unsigned>(digit)) & 0xFU];
  }
}

}  // namespace

std::string frame_text(const protocol::Frame& frame) {
  const bool error = frame.kind == protocol::FrameKind::kError;
  std::string text;
  add_hex(text, frame.id | (error ? kErrorFlag : 0U), frame.extended || error ? 8 : 3);
  text += '#';
  if (frame.kind == protocol::FrameKind::kFd) return text + '#';
  if (frame.kind == protocol::FrameKind::kRemote) return text + 'R';
  for (std::size_t n = 0; n < frame.dlc && n < frame.data.size(); ++n) {
    add_hex(text, frame.data[n], 2);
  }
  return text;
}

}  // namespace lk::emulator
