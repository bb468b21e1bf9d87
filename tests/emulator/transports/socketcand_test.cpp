// socketcand's protocol, word for word by its doc/protocol.md and its source.

#include "emulator/io/transports/socketcand.hpp"

#include <gtest/gtest.h>

#include "tests/support/frames.hpp"

namespace lk::emulator {
namespace socketcand_test {

using protocol::Frame;
using protocol::FrameKind;
using test::frame;
using namespace std::chrono_literals;

ParsedInput say(Socketcand& daemon, std::string_view text, ClientProtocol::Time now = 0s) {
  ParsedInput parsed;
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(text.data());
  daemon.parse({bytes, text.size()}, now, parsed);
  return parsed;
}

std::string shown(Socketcand& daemon, const Frame& what, ClientProtocol::Time now = 1500ms) {
  std::string out;
  daemon.encode(what, now, out);
  return out;
}

void open(Socketcand& daemon, std::string_view mode = "") {
  EXPECT_EQ(say(daemon, "< open can0 >").response, "< ok >");
  if (!mode.empty()) {
    EXPECT_EQ(say(daemon, mode).response, "< ok >");
  }
}

TEST(Socketcand, GreetsAndOpens) {
  Socketcand daemon;
  EXPECT_EQ(daemon.greeting(), "< hi >");
  EXPECT_EQ(say(daemon, "< send 141 0 >").response, "< error unknown command >");
  EXPECT_EQ(say(daemon, "< echo >").response, "< echo >");
  EXPECT_EQ(shown(daemon, frame("141#9A")), "");
  open(daemon, "< rawmode >");
  EXPECT_EQ(say(daemon, "< open can0 >").response, "< error unknown command >");
}

TEST(Socketcand, SendsValidFrames) {
  Socketcand daemon;
  open(daemon, "< rawmode >");
  const ParsedInput parsed =
      say(daemon, "< send 141 8 9A 0 0 0 0 0 0 f ><send 00000141 0>\n< sendrtr 142 3 >");
  ASSERT_EQ(parsed.frames.size(), 3U);
  EXPECT_EQ(parsed.response, "");
  EXPECT_EQ(parsed.frames[0], frame("141#9A0000000000000F"));
  EXPECT_TRUE(parsed.frames[1].extended);
  EXPECT_EQ(parsed.frames[2].kind, FrameKind::kRemote);
  EXPECT_EQ(parsed.frames[2].dlc, 3);
  // Above the standard identifiers, as python-can sends it.
  EXPECT_TRUE(say(daemon, "< send 800 0 >").frames.at(0).extended);
}

TEST(Socketcand, RejectsMalformedCommands) {
  Socketcand daemon;
  open(daemon, "< rawmode >");
  for (const char* text :
       {"< >", ">", "send 141 0 >", "< send >", "< send 141 >", "< send 141 9 >", "< send 141 1 >",
        "< send 141 1 100 >", "< send 141 1 0 0 >", "< send 141 1 G >", "< send 20000000 0 >",
        "< send -1 0 >", "< send 141 8 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 >", "< controlmode >",
        "< add 1 0 141 0 >", "< sendrtr 141 9 >"}) {
    const ParsedInput parsed = say(daemon, text);
    EXPECT_EQ(parsed.response, "< error unknown command >") << text;
    EXPECT_EQ(parsed.malformed, 1U) << text;
    EXPECT_TRUE(parsed.frames.empty()) << text;
  }
  EXPECT_EQ(say(daemon, std::string(100'000, '<') + ">").response, "< error unknown command >");
  EXPECT_EQ(say(daemon, "< send 141 0 >").frames.size(), 1U);
}

TEST(Socketcand, ForwardsAllFramesInRawMode) {
  Socketcand daemon;
  open(daemon, "< rawmode >");
  EXPECT_EQ(shown(daemon, frame("141#9A1900F000000000")),
            "< frame 141 1.500000 9A1900F000000000 >");
  EXPECT_EQ(shown(daemon, {.id = 0x141, .extended = true, .dlc = 0}),
            "< frame 00000141 1.500000  >");
  EXPECT_EQ(shown(daemon, {.id = 0x142, .kind = FrameKind::kRemote, .dlc = 3}),
            "< rtr 142 1.500000 3 >");
  EXPECT_EQ(shown(daemon, {.id = 0x8, .kind = FrameKind::kError}), "< error 008 1.500000 >");
}

TEST(Socketcand, ForwardsSubscribedIdentifiers) {
  Socketcand daemon;
  open(daemon);
  EXPECT_EQ(shown(daemon, frame("141#9A")), "");
  EXPECT_EQ(say(daemon, "< subscribe 0 0 141 >").response, "");
  EXPECT_EQ(shown(daemon, frame("141#9A01")), "< frame 141 1.500000 9A 01  >");
  EXPECT_EQ(shown(daemon, frame("142#9A")), "");
  EXPECT_EQ(say(daemon, "< unsubscribe 141 >").response, "");
  EXPECT_EQ(shown(daemon, frame("141#9A")), "");
  say(daemon, "< subscribe 0 10000 141 >");
  EXPECT_NE(shown(daemon, frame("141#9A"), 0ms), "");
  EXPECT_EQ(shown(daemon, frame("141#9A"), 9ms), "");
  EXPECT_NE(shown(daemon, frame("141#9A"), 10ms), "");
}

TEST(Socketcand, FiltersForwardChangesOnly) {
  Socketcand daemon;
  open(daemon);
  say(daemon, "< filter 0 0 141 2 0 F0 >");
  EXPECT_NE(shown(daemon, frame("141#0100")), "");
  EXPECT_EQ(shown(daemon, frame("141#020F")), "");
  EXPECT_NE(shown(daemon, frame("141#0210")), "");
}

TEST(Socketcand, JobsAreSentInCycles) {
  Socketcand daemon;
  open(daemon);
  EXPECT_EQ(daemon.next_due(), std::nullopt);
  EXPECT_EQ(say(daemon, "< add 0 20000 141 1 9A >", 1s).response, "");
  EXPECT_EQ(daemon.next_due(), 1020ms);
  std::vector<Frame> sent;
  daemon.take_due(1019ms, sent);
  EXPECT_TRUE(sent.empty());
  daemon.take_due(1020ms, sent);
  say(daemon, "< update 141 1 9C >");
  daemon.take_due(1040ms, sent);
  EXPECT_EQ(sent, (std::vector{frame("141#9A"), frame("141#9C")}));
  say(daemon, "< delete 141 >");
  EXPECT_EQ(daemon.next_due(), std::nullopt);
  EXPECT_EQ(say(daemon, "< add 0 999 141 0 >").response, "< error unknown command >");
}

TEST(Socketcand, JobsAreBounded) {
  Socketcand daemon;
  open(daemon);
  std::uint64_t refused = 0;
  for (int id = 0; id < 0x7FF; ++id) {
    char text[40];
    std::snprintf(text, sizeof text, "< add 1 0 %X 0 >", static_cast<unsigned>(id));
    refused += say(daemon, text).malformed;
  }
  EXPECT_EQ(refused, 0x7FF - Socketcand::kMaxJobs);
}

TEST(Socketcand, BeaconHasNameAndAddress) {
  EXPECT_EQ(beacon_text("arm", "127.0.0.1", 29536),
            "<CANBeacon name=\"arm\" type=\"SocketCAN\" description=\"lk-emu\">\n"
            "<URL>can://127.0.0.1:29536</URL><Bus name=\"can0\"/></CANBeacon>");
}

}  // namespace socketcand_test
}  // namespace lk::emulator
