// How a receiver splits bytes into packets and garbage, in slices of any size.

#include "protocol/serial_framing.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <random>
#include <utility>

#include "protocol/codec.hpp"
#include "tests/support/serial.hpp"

namespace lk::protocol {
namespace serial_framing_test {

using namespace std::chrono_literals;
using test::Bytes;
using test::bytes;
using test::hex;
using test::packet;

constexpr std::chrono::nanoseconds kByte = 10us;  // 1 Mbit/s

/// Bytes on the line, back to back except for explicit pauses.
struct Line {
  Receiver receiver;
  std::chrono::nanoseconds now{1s};
  std::vector<std::string> received = {};

  void send(const Bytes& sent) {
    for (const std::uint8_t byte : sent) {
      if (const auto frame = receiver.feed(byte, now, now + kByte)) received.push_back(hex(*frame));
      now += kByte;
    }
  }
  void send(const char* text) { send(bytes(text)); }
};

TEST(SerialFraming, RejectsWrongSumsPrintedByTheVendor) {
  for (const char* text : {"3E 12 01 00 45", "02 88 9C 00 00 00 00 00 81 00 CF"}) {
    EXPECT_FALSE(packet_at(bytes(text))) << text;
    Line line{Receiver({})};
    line.send(text);
    EXPECT_TRUE(line.received.empty()) << text;
  }
}

TEST(SerialFraming, SplitsBytesIntoPacketsAndOtherBytes) {
  std::vector<Frame> frames;
  append_frames(bytes("00 3E 9A 01 00 D9 3E 9A 01 00 D8 02 82 50 46 00 00 00 00 D8 DC CE FF"),
                frames);
  ASSERT_EQ(frames.size(), 5U);
  EXPECT_EQ(frames[0].kind, FrameKind::kBytes);
  EXPECT_EQ(hex(frames[1]), "3E 9A 01 00 D9");
  EXPECT_EQ(frames[2].kind, FrameKind::kBytes);
  EXPECT_EQ(hex(frames[2]), "3E 9A 01 00 D8");
  EXPECT_EQ(frames[3].id, 0x282U);
  EXPECT_EQ(hex(frames[4]), "FF");
  EXPECT_EQ(address(frames[0]), (std::variant<int, Reject>(Reject::kNoPacket)));
}

TEST(SerialReceiver, DropsByCauseAndCounts) {
  Line line{Receiver({.max_len = 60})};
  line.send("00 FF");                    // no start of a packet
  line.send("3E 9A 01 00 DA");           // the header's sum is wrong
  line.send("3E 17 01 3D 93");           // LEN 61
  line.send("3E A1 01 02 E2 64 00 65");  // the data's sum is wrong
  line.send("3E A1 01");                 // stops in the middle
  line.now += 5ms;
  line.send("3E 9A 01 00 D9");
  EXPECT_EQ(line.received, std::vector<std::string>{"3E 9A 01 00 D9"});
  const ReceiverStats& stats = line.receiver.stats();
  EXPECT_EQ(stats.skipped_bytes, 2U + 5U + 5U);
  EXPECT_EQ(stats.bad_headers, 1U);
  EXPECT_EQ(stats.too_long, 1U);
  EXPECT_EQ(stats.bad_data, 1U);
  EXPECT_EQ(stats.incomplete_packets, 1U);
}

/// Any byte may start a packet of either kind; 0x3E may also occur inside a multi-drive packet.
TEST(SerialReceiver, DoesNotCountBytesOfMultiDrivePacketsAsSkipped) {
  Line line{Receiver({})};
  line.send("02 82 50 46 00 00 00 00 D8 DC CE");
  line.now += 1ms;
  line.send("02 82 3E 9A 01 00 DA 00 D8 DC EB");
  EXPECT_EQ(line.received.size(), 2U);
  EXPECT_EQ(line.receiver.stats(), ReceiverStats{});
  line.now += 1ms;
  line.send("02 82 50 46 00 00 00 00 D8 DC CF");
  EXPECT_EQ(line.receiver.stats().bad_data, 1U);
  EXPECT_EQ(line.receiver.stats().skipped_bytes, 11U);
}

TEST(SerialReceiver, ScanDecidesWhereItResumesAfterABadHeader) {
  for (const bool scan : {true, false}) {
    Line line{Receiver({.scan = scan})};
    // A packet inside an apparent header.
    line.send("3E 3E 9A 01 00 D9");
    EXPECT_EQ(line.received.size(), scan ? 1U : 0U);
    line.send("3E 9A 01 00 D9");
    EXPECT_EQ(line.received.size(), scan ? 2U : 0U);
    line.now += 5ms;
    line.send("3E 9A 01 00 D9");
    EXPECT_EQ(line.received.size(), scan ? 3U : 1U);
  }
}

/// Without a gap the next packet's bytes count as data of the broken packet.
TEST(SerialReceiver, DropsAnIncompletePacketAfterTheGap) {
  for (const auto gap : {4ms, 6ms}) {
    Line line{Receiver({})};
    line.send("3E A2 01 04 E5 A0");
    line.now += gap;
    line.send("3E 9A 01 00 D9");  // four of them count as data of A2
    EXPECT_EQ(line.received.size(), gap > 5ms ? 1U : 0U);
  }
}

TEST(SerialReceiver, MultiDrivePacketNeedsAnIdleLineBeforeIt) {
  const char* const kPacket = "02 81 00 00 68 01 00 00 30 FD 19";
  const ReceiverRules rules{.broadcast_gap = 20us};  // 20 bits at 1 Mbit/s
  Line first{Receiver(rules)};
  first.send(kPacket);
  EXPECT_EQ(first.received.size(), 1U);
  first.send(kPacket);  // without a pause before it
  EXPECT_EQ(first.received.size(), 1U);
  first.now += 20us;
  first.send(kPacket);
  EXPECT_EQ(first.received.size(), 2U);
  first.now += 20us;
  first.send("02 81 00 00 68");
  first.now += 20us;  // a pause inside
  first.send("01 00 00 30 FD 19");
  EXPECT_EQ(first.received.size(), 2U);
  first.send("3E 9A 01 00 D9");
  EXPECT_EQ(first.received.size(), 3U);
}

/// The broadcast contains 3E 00 00 00 00, a bad header. The next packet must still be received,
/// also without `scan`.
TEST(SerialReceiver, MultiDrivePacketEndsADropInsideIt) {
  Line line{Receiver({.scan = false, .broadcast_gap = 20us})};
  line.send("02 81 3E 00 00 00 00 00 00 00 C1");
  line.send("3E 9A 01 00 D9");
  EXPECT_EQ(line.received.size(), 2U);
}

/// Returns garbage that contains good packets; deterministic for a seed.
Bytes rubbish(std::mt19937& random, int pieces) {
  Bytes all;
  for (int n = 0; n < pieces; ++n) {
    if (random() % 2 == 0) {
      const Bytes good = bytes("3E A4 01 0C EF 50 46 00 00 00 00 00 00 A0 8C 00 00 C2");
      const std::size_t length = random() % 4 == 0 ? random() % good.size() : good.size();
      all.insert(all.end(), good.begin(), good.begin() + static_cast<std::ptrdiff_t>(length));
    } else {
      for (auto k = random() % 20; k > 0; --k) {
        all.push_back(random() % 3 == 0 ? 0x3E : static_cast<std::uint8_t>(random()));
      }
    }
  }
  return all;
}

TEST(SerialReceiver, SlicesDoNotChangeTheResult) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    const Bytes all = rubbish(random, 30);
    Line whole{Receiver({.scan = seed % 2 == 0})};
    whole.send(all);
    // The slices are those of a host that writes frames; the bytes are equal.
    Line sliced{Receiver({.scan = seed % 2 == 0})};
    for (std::size_t at = 0; at < all.size();) {
      const std::size_t size = std::min<std::size_t>(1 + random() % 40, all.size() - at);
      std::vector<Frame> frames;
      append_frames(std::span(all).subspan(at, size), frames);
      for (const Frame& frame : frames) {
        const auto view = wire_bytes(frame);
        sliced.send(Bytes(view.view().begin(), view.view().end()));
      }
      at += size;
    }
    EXPECT_EQ(sliced.received, whole.received) << seed;
    EXPECT_EQ(sliced.now, whole.now) << seed;
    EXPECT_EQ(sliced.receiver.stats(), whole.receiver.stats()) << seed;
    // After a pause a packet is found, whatever preceded it.
    whole.now += 5ms;
    whole.received.clear();
    whole.send("3E 9A 01 00 D9");
    EXPECT_EQ(whole.received, std::vector<std::string>{"3E 9A 01 00 D9"}) << seed;
  }
}

TEST(SerialFraming, PacketsSurviveARoundTrip) {
  std::mt19937 random(1);
  for (int n = 0; n < 2000; ++n) {
    Frame frame;
    frame.kind = FrameKind::kSerial;
    frame.id = kSingleDriveId + random() % 256;
    frame.dlc = static_cast<std::uint8_t>(1 + random() % (kMaxLen + 1));
    for (std::size_t k = 0; k < frame.dlc; ++k) frame.data[k] = static_cast<std::uint8_t>(random());
    const WireBytes sent = wire_bytes(frame);
    EXPECT_EQ(sent.size, frame.dlc == 1 ? 5U : 5U + frame.dlc);
    EXPECT_EQ(packet_at(sent.view()), frame);
  }
}

/// From a real drive whose host's terminal had ICRNL set: as sent, and as received.
TEST(SerialFraming, LineFeedInPlaceOfCarriageReturnBreaksTheSum) {
  const std::pair<const char*, const char*> replies[] = {
      {"3E A4 01 07 EA 21 00 00 0D 00 2C 19 73", "3E A4 01 07 EA 21 00 00 0A 00 2C 19 73"},
      {"3E A4 01 07 EA 21 6C 00 AE 02 B0 20 0D", "3E A4 01 07 EA 21 6C 00 AE 02 B0 20 0A"},
      {"3E A4 01 07 EA 21 64 00 82 02 74 90 0D", "3E A4 01 07 EA 21 64 00 82 02 74 90 0A"},
      {"3E A4 01 07 EA 21 52 00 0D 02 FC AA 28", "3E A4 01 07 EA 21 52 00 0A 02 FC AA 28"}};
  for (const auto& [sent, arrived] : replies) {
    EXPECT_EQ(bytes_frame(bytes(sent)).kind, FrameKind::kSerial) << sent;
    EXPECT_EQ(bytes_frame(bytes(arrived)).kind, FrameKind::kBytes) << arrived;
  }
}

}  // namespace serial_framing_test
}  // namespace lk::protocol
