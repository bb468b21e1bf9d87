#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "emulator/io/transports/serial_port.hpp"
#include "protocol/serial_framing.hpp"
#include "tests/support/serial.hpp"

namespace lk::emulator {
namespace serial_bytes_test {

using protocol::Frame;
using protocol::FrameKind;
using test::bytes;
using test::hex;

constexpr ClientProtocol::Time kNow{0};
const std::string kAsk = "3E 9C 01 00 DB";

std::vector<Frame> taken(const std::string& digits) {
  SerialBytes port;
  ParsedInput parsed;
  port.parse(bytes(digits), kNow, parsed);
  EXPECT_EQ(parsed.response, "");
  EXPECT_EQ(parsed.malformed, 0U);
  return parsed.frames;
}

std::string data(const std::vector<Frame>& frames) {
  std::string text;
  for (const Frame& frame : frames) text += (text.empty() ? "" : " ") + hex(frame);
  return text;
}

// FF FB 2C is a telnet negotiation, but all bytes on this port are data.
TEST(SerialBytes, PassesAllBytesUnchanged) {
  for (const std::string& digits : {kAsk, kAsk + " FF FB 2C FF FF", std::string("FF FB 2C 3E"),
                                    std::string("FF FF"), std::string("FF 00")}) {
    const auto frames = taken(digits);
    EXPECT_EQ(data(frames), digits);
    EXPECT_EQ(frames.front().kind == FrameKind::kSerial, digits.starts_with(kAsk));
    SerialBytes port;
    std::string out;
    for (const Frame& frame : frames) port.encode(frame, kNow, out);
    EXPECT_EQ(hex(std::vector<std::uint8_t>(out.begin(), out.end())), digits);
  }
  EXPECT_EQ(taken(kAsk).size(), 1U);
}

}  // namespace serial_bytes_test
}  // namespace lk::emulator
