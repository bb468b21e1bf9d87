// Frames that wait on a line without an interface while time stands still.

#include "emulator/io/live/line.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/log.hpp"
#include "tests/support/serial_bus.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace line_test {

TEST(Line, LimitsBacklogAndCountsDroppedFrames) {
  const test::Log log;
  Line line(test::bus_config({1, 2, 3}));
  TimedFrame filler;  // which all drives ignore
  filler.frame.kind = protocol::FrameKind::kError;
  line.enqueue({SimTime{0}, test::frame("141#9A00000000000000")});
  for (std::size_t n = 2; n < Line::kMaxBacklog; ++n) line.enqueue(filler);
  line.enqueue({SimTime{0}, test::frame("142#9A00000000000000")});
  EXPECT_EQ(line.backlog_lost(), 0U);
  for (int n = 0; n < 3; ++n) {
    line.enqueue({SimTime{0}, test::frame("143#9A00000000000000")});
  }
  EXPECT_EQ(line.backlog(), Line::kMaxBacklog);
  EXPECT_EQ(line.backlog_lost(), 3U);
  EXPECT_EQ(log.text(),
            "test: 1000000 frames are queued while time is stopped; further frames are lost\n")
      << "once";
  EXPECT_EQ(line.bus().stats().frames, 0U) << "time has not moved";

  line.advance_to(std::chrono::milliseconds(1), MonoTime::max(), Line::WaitPolicy::kNone);
  EXPECT_EQ(line.backlog(), 0U);
  EXPECT_EQ(line.bus().stats().frames, Line::kMaxBacklog);
  EXPECT_EQ(line.bus().servo(1).stats.replies, 1U) << "the first";
  EXPECT_EQ(line.bus().servo(2).stats.replies, 1U) << "the last that was kept";
  EXPECT_EQ(line.bus().servo(3).stats.replies, 0U) << "lost";
}

/// A host that waits 50 ms for each reply and then retries, with a process that was stopped for 0.4
/// s.
TEST(Line, DeliversPacketsOneByOneAfterASlip) {
  Line line(test::serial_bus({test::serial_drive(Generation::kV236)}));
  const auto advance_by = [&](SimTime duration) {
    line.advance_to(line.bus().time() + duration, MonoTime::max(), Line::WaitPolicy::kNone);
  };
  for (int stop = 0; stop < 4; ++stop) {
    line.note_slip();
    std::vector<protocol::Frame> packets;
    for (int n = 0; n < 8; ++n) protocol::append_frames(test::bytes("3E 9A 01 00 D9"), packets);
    for (const protocol::Frame& packet : packets) line.accept({line.bus().time(), packet});
    advance_by(std::chrono::milliseconds(400));
  }
  // The host takes a late reply for the answer to its next packet and sends early, while the drive
  // answers the last of eight packets. Each packet takes 330 us with its reply.
  line.note_slip();
  const auto packet = protocol::bytes_frame(test::bytes("3E 9A 01 00 D9"));
  for (int n = 0; n < 8; ++n) line.accept({line.bus().time(), packet});
  advance_by(std::chrono::microseconds(7 * 330 + 90));
  ASSERT_EQ(line.backlog(), 0U);
  line.accept({line.bus().time(), packet});
  advance_by(std::chrono::milliseconds(400));
  EXPECT_EQ(line.bus().servo(1).stats.replies, 41U);
  EXPECT_EQ(line.bus().stats().replies, 41U);
  EXPECT_EQ(line.backlog(), 0U);
  EXPECT_TRUE(line.adviser().advice().empty())
      << advice_line("", line.adviser().advice().front(), Language::kEnglish);
}

/// Returns the longest frame of bytes without a packet, marked by a number.
protocol::Frame noise(int number) {
  protocol::Frame frame;
  frame.kind = protocol::FrameKind::kBytes;
  frame.dlc = protocol::kMaxBytes;
  frame.data[0] = static_cast<std::uint8_t>(number);
  return frame;
}

TEST(Line, QueuesAFloodInOrderAfterASlip) {
  Line line(test::serial_bus({test::serial_drive(Generation::kV236)}));
  std::vector<int> heard;
  Listener listener;
  listener.query = [&](const TimedFrame& in) { heard.push_back(in.frame.data[0]); };
  line.listeners.insert(line.listeners.end(), listener);
  std::vector<int> sent;
  const auto send = [&](int count) {
    for (int n = 0; n < count; ++n) {
      sent.push_back(static_cast<int>(sent.size()));
      const SimTime at = std::chrono::microseconds(10) * sent.back();
      line.accept({at, noise(sent.back())});
    }
  };
  send(30);  // 3540 of the 4096 bytes of the line's buffer
  line.note_slip();
  send(70);
  line.advance_to(std::chrono::seconds(1), MonoTime::max(), Line::WaitPolicy::kNone);
  EXPECT_EQ(heard, sent);
  EXPECT_EQ(line.bus().stats().count(Drop::kQueueFull), 0U);
  EXPECT_EQ(line.backlog(), 0U);
}

TEST(Line, LimitsAFloodAfterASlip) {
  Line line(test::serial_bus({test::serial_drive(Generation::kV236)}));
  line.note_slip();
  for (int n = 0; n < 2000; ++n) line.accept({SimTime{0}, noise(n)});
  // One frame is on the wire, 35 of 118 bytes fill the queue of 4096 bytes, 64 wait for room.
  EXPECT_EQ(line.backlog(), 64U);
  EXPECT_EQ(line.bus().stats().count(Drop::kQueueFull), 2000U - 100U);
  line.advance_to(std::chrono::seconds(1), MonoTime::max(), Line::WaitPolicy::kNone);
  EXPECT_EQ(line.backlog(), 0U);
  EXPECT_EQ(line.bus().stats().frames, 2000U);
  EXPECT_EQ(line.bus().stats().count(Drop::kQueueFull), 2000U - 100U) << "what waited is not lost";
}

}  // namespace line_test
}  // namespace lk::emulator
