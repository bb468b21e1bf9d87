// Bytes by hand from RFC 854, section "TELNET COMMAND STRUCTURE", and RFC 2217: FF is IAC, FB to FE
// are WILL, WON'T, DO, DON'T, FA and F0 the begin and end of a subnegotiation, 2C is
// COM-PORT-OPTION.

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "emulator/transports/serial_bytes.hpp"
#include "protocol/serial_framing.hpp"
#include "tests/support/serial.hpp"

namespace lk::emulator {
namespace rfc2217_test {

using protocol::Frame;
using protocol::FrameKind;
using test::bytes;
using test::hex;

constexpr ClientProtocol::Time kNow{0};
const std::string kOffer = "FF FB 00 FF FD 00 ";              // WILL BINARY, DO BINARY
const std::string kBegin = "FF FB 2C ";                       // WILL COM-PORT-OPTION
const std::string kBegun = "FF FD 2C FF FA 2C 6B 00 FF F0 ";  // DO COM-PORT-OPTION; no modem
const std::string kAsk = "3E 9C 01 00 DB";

std::vector<std::uint8_t> as_bytes(const std::string& text) { return {text.begin(), text.end()}; }

/// A client of a bus of 1 Mbit/s.
struct Client {
  explicit Client(std::int64_t bitrate = 1'000'000) : port(bitrate) {}

  /// What it is answered.
  std::string say(const std::string& digits) {
    heard = {};
    port.take(bytes(digits), kNow, heard);
    return hex(as_bytes(heard.answer));
  }
  std::string shown(const std::string& digits) {
    const auto data = bytes(digits);
    std::vector<Frame> frames;
    protocol::append_frames(data, frames);
    std::string out;
    for (const Frame& frame : frames) port.show(frame, kNow, out);
    return hex(as_bytes(out));
  }
  std::string data() const {
    std::string text;
    for (const Frame& frame : heard.frames) text += (text.empty() ? "" : " ") + hex(frame);
    return text;
  }

  SerialBytes port;
  FromClient heard;
};

TEST(Rfc2217, BytesAreRawUnlessTheyBeginWithACommandOfTelnet) {
  Client raw;
  EXPECT_EQ(raw.say(kAsk + "FF FB 2C FF FF"), "");
  EXPECT_EQ(raw.data(), kAsk + " FF FB 2C FF FF");
  EXPECT_EQ(raw.shown("FF FF 01"), "FF FF 01");
  for (const std::string& first :
       {std::string("FF 3E"), std::string("FF FF"), std::string("FF 00")}) {
    Client noisy;
    EXPECT_EQ(noisy.say(first + kBegin), "");
    EXPECT_EQ(noisy.data(), first + " " + "FF FB 2C");
  }
}

TEST(Rfc2217, AClientThatNegotiatesHasTelnet) {
  Client client;
  EXPECT_EQ(client.say(kBegin), hex(kOffer + kBegun));
  EXPECT_EQ(client.say("FF FD 2C"), "FF FB 2C");
  EXPECT_EQ(client.say("FF FD 03 FF FB 03"), "FF FB 03 FF FD 03");  // suppress go ahead
  EXPECT_EQ(client.say("FF FB 00 FF FD 00"), "");                   // what was offered
  EXPECT_EQ(client.say("FF FB 2C FF FD 2C"), "");                   // what is so already
  EXPECT_EQ(client.say("FF FD 01 FF FB 18"), "FF FC 01 FF FE 18");  // no echo, no terminal type
  EXPECT_EQ(client.say("FF FE 01 FF FC 18"), "");
  EXPECT_EQ(client.say("FF FE 03 FF FC 03"), "FF FC 03 FF FE 03");
  EXPECT_EQ(client.heard.malformed, 0U);
}

TEST(Rfc2217, OfDataFFIsDoubled) {
  Client client;
  EXPECT_EQ(client.say(kBegin + "01 FF FF 02 FF F1 03"), hex(kOffer + kBegun));  // F1: no operation
  EXPECT_EQ(client.data(), "01 FF 02 03");
  EXPECT_EQ(client.shown("00 FF 01"), "00 FF FF 01");
  client.say(kAsk);
  EXPECT_EQ(client.heard.frames.at(0).kind, FrameKind::kSerial);
}

TEST(Rfc2217, SettingsAreAnsweredWithWhatIsInForce) {
  Client client;
  client.say(kBegin);
  const auto sub = [&](const std::string& digits) {
    return client.say("FF FA 2C " + digits + " FF F0");
  };
  const auto says = [](const std::string& digits) { return "FF FA 2C " + digits + " FF F0"; };
  EXPECT_EQ(sub("01 00 00 00 00"), says("65 00 0F 42 40"));  // 1 Mbit/s until it is set
  EXPECT_EQ(sub("01 00 01 C2 00"), says("65 00 01 C2 00"));  // 115200
  EXPECT_EQ(sub("01 00 00 00 00"), says("65 00 01 C2 00"));
  EXPECT_EQ(sub("01 00 FF FF 00 00"), says("65 00 FF FF 00 00"));  // FF is doubled here as well
  EXPECT_EQ(sub("02 00"), says("66 08"));
  EXPECT_EQ(sub("02 07"), says("66 08"));
  EXPECT_EQ(sub("03 03"), says("67 01"));  // even parity asked for
  EXPECT_EQ(sub("04 02"), says("68 01"));
  EXPECT_EQ(sub("00"), says("64 6C 6B 2D 65 6D 75"));  // lk-emu
  EXPECT_EQ(sub("00 41 42"), "");                      // the client's own signature
  EXPECT_EQ(sub("0A FF FF"), says("6E FF FF"));
  EXPECT_EQ(sub("0B 05"), says("6F 05"));
  EXPECT_EQ(sub("0C 03"), says("70 03"));
  EXPECT_EQ(sub("07"), says("6B 00"));
  EXPECT_EQ(sub("08"), "");
  EXPECT_EQ(client.heard.malformed, 0U);
}

TEST(Rfc2217, LinesThatAHostSetsAreKept) {
  Client client;
  client.say(kBegin);
  const auto control = [&](const std::string& value) {
    const std::string answer = client.say("FF FA 2C 05 " + value + " FF F0");
    return answer.empty() ? "" : answer.substr(12, 2);
  };
  for (const auto& [first, on, off] :
       {std::array<const char*, 3>{"04", "05", "06"}, std::array<const char*, 3>{"07", "08", "09"},
        std::array<const char*, 3>{"0A", "0B", "0C"}}) {
    EXPECT_EQ(control(first), off);
    EXPECT_EQ(control(on), on);
    EXPECT_EQ(control(first), on);
    EXPECT_EQ(control(off), off);
  }
  EXPECT_EQ(control("03"), "01");  // no flow control on two wires
  EXPECT_EQ(control("10"), "0E");
  EXPECT_EQ(control("14"), "");
  EXPECT_EQ(client.heard.malformed, 1U);
}

TEST(Rfc2217, AnotherRateIsSilence) {
  Client client;
  client.say(kBegin + "FF FA 2C 01 00 01 C2 00 FF F0" + kAsk);
  EXPECT_EQ(client.heard.trouble,
            "is at 115200 bit/s and the drives are at 1000000: nobody understands it");
  ASSERT_EQ(client.heard.frames.size(), 1U);
  EXPECT_EQ(client.heard.frames[0].kind, FrameKind::kBytes);
  EXPECT_EQ(client.shown(kAsk), "");
  client.say("FF FA 2C 01 00 0F 42 40 FF F0" + kAsk);
  EXPECT_EQ(client.data(), kAsk);
  EXPECT_EQ(client.shown(kAsk), kAsk);
  Client any(0);
  any.say(kBegin + "FF FA 2C 01 00 01 C2 00 FF F0" + kAsk);
  EXPECT_EQ(any.data(), kAsk);
}

TEST(Rfc2217, WhatMakesNoSenseIsCountedAndEndsNothing) {
  Client client;
  client.say(kBegin);
  const auto malformed = [&](const std::string& digits) {
    EXPECT_EQ(client.say(digits), "") << digits;
    return client.heard.malformed;
  };
  EXPECT_EQ(malformed("FF 00"), 1U);
  EXPECT_EQ(malformed("FF F0"), 1U);                    // an end without a beginning
  EXPECT_EQ(malformed("FF FA FF F0"), 1U);              // nothing
  EXPECT_EQ(malformed("FF FA 2C FF F0"), 1U);           // no command
  EXPECT_EQ(malformed("FF FA 2C 0D 01 FF F0"), 1U);     // none of RFC 2217
  EXPECT_EQ(malformed("FF FA 2C 01 00 00 FF F0"), 1U);  // three bytes short
  EXPECT_EQ(malformed("FF FA 2C 02 08 08 FF F0"), 1U);
  EXPECT_EQ(malformed("FF FA 2C 00 (70 x 41) FF F0"), 1U);    // longer than any
  EXPECT_EQ(malformed("FF FA 18 00 FF F0"), 0U);              // of an option that was not agreed on
  EXPECT_EQ(client.say("FF FA 2C 0C FF FB 03"), "FF FD 03");  // a subnegotiation has no end
  EXPECT_EQ(client.heard.malformed, 1U);
  client.say(kAsk);
  EXPECT_EQ(client.data(), kAsk);
}

}  // namespace rfc2217_test
}  // namespace lk::emulator
