// A bus with drives: effect of queries, time of replies, dropped frames and their reasons. Lengths
// counted by hand, see can_wire_test.cpp; further ones:
//
//   141#9A1900F000000000   10 stuff bits: 118 bits
//     00010100000(1)10001000100110100001100100000(1)000111100000(1)00000(1)00000(1)00000(1)00000(1)00000(1)
//     00000(1)01011111(0)10100010
//   141#A119000000000008   10 stuff bits: 118 bits
//     00010100000(1)10001000101000010001100100000(1)00000(1)00000(1)00000(1)00000(1)00000(1)00000(1)00000(1)
//     0000100000(1)1011100001011
//   142#A119000000000008    9 stuff bits: 117 bits
//     0001010000100001000101000010001100100000(1)00000(1)00000(1)00000(1)00000(1)00000(1)00000(1)00000(1)
//     0000100000(1)0101000100110
//   7FF#0000000000000000   15 stuff bits: 123 bits
//     011111(0)11111(0)1000100000(1)00000(1) … 00010101001000011

#include "emulator/core/bus/bus.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/emulator/core/core_support.hpp"
#include "tests/support/golden_trace.hpp"

namespace lk::emulator {
namespace bus_test {

using namespace std::chrono_literals;
using test::bus_config;
using test::frame;
using test::run_until;

constexpr std::int64_t kBitrate = 1'000'000;

const protocol::Frame kQuery = frame("141#9A00000000000000");  // 120 bits
const protocol::Frame kReply = frame("141#9A1900F000000000");  // 118 bits

TEST(BusTiming, ReplyFollowsQueryAndReplyTime) {
  Bus bus(bus_config({1}, kBitrate));
  EXPECT_EQ(bus.next_due(), std::nullopt);
  bus.receive({0us, kQuery});
  EXPECT_EQ(bus.next_due(), 120us);
  EXPECT_TRUE(run_until(bus, 120us - 1ns).empty());
  EXPECT_EQ(bus.servo(1).stats.queries, 0U);
  EXPECT_TRUE(run_until(bus, 120us).empty());
  EXPECT_EQ(bus.servo(1).stats.queries, 1U);
  EXPECT_EQ(bus.next_due(), 120us + 100us + 118us);
  EXPECT_TRUE(run_until(bus, 338us - 1ns).empty());
  const auto replies = run_until(bus, 338us);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies[0], (TimedFrame{338us, kReply}));
  EXPECT_EQ(bus.next_due(), std::nullopt);
  EXPECT_EQ(bus.stats().wire_busy, 123us + 121us);
  EXPECT_TRUE(run_until(bus, 1s).empty());
}

/// A host with a sender ID: the others receive its frame when its last bit is on the wire.
TEST(BusTiming, HostsReceiveEachOthersFrames) {
  Bus bus(bus_config({1}, kBitrate));
  const TimedFrame query{.at = 0us, .frame = kQuery, .sender = 7};
  const TimedFrame foreign{.at = 0us, .frame = frame("7FF#0000000000000000"), .sender = 9};
  bus.receive(query);
  bus.receive(foreign);
  EXPECT_TRUE(run_until(bus, 120us - 1ns).empty());
  const auto received = run_until(bus, 1ms);
  ASSERT_EQ(received.size(), 3U);
  EXPECT_EQ(received[0], (TimedFrame{.at = 120us, .frame = query.frame, .sender = 7}));
  EXPECT_EQ(received[1], (TimedFrame{.at = 123us + 123us, .frame = foreign.frame, .sender = 9}));
  // Ready at 220 µs, while the second query occupies the wire.
  EXPECT_EQ(received[2], (TimedFrame{123us + 126us + 118us, kReply}));
  EXPECT_EQ(bus.stats().replies, 1U);
  EXPECT_EQ(bus.stats().replies_waiting, 0U);
}

TEST(BusTiming, ReplyTimeIsConfigurable) {
  auto config = bus_config({1}, kBitrate);
  config.servos[0].reply_time = 200us;
  Bus bus(config);
  bus.receive({0us, kQuery});
  EXPECT_EQ(run_until(bus, 1ms).at(0).at, 438us);
}

TEST(BusTiming, RepliesInterleaveWithPipelinedQueries) {
  Bus bus(bus_config({1}, kBitrate));
  for (int n = 0; n < 3; ++n) bus.receive({0us, kQuery});
  const auto replies = run_until(bus, 2ms);
  ASSERT_EQ(replies.size(), 3U);
  // Queries end at 120, 243; the first reply is ready at 220 and goes before the third query.
  EXPECT_EQ(replies[0].at, 246us + 118us);
  // The wire is free at 367; the second reply is ready since 343 and goes before the third query.
  EXPECT_EQ(replies[1].at, 367us + 118us);
  // Third query 488..608, ready at 708.
  EXPECT_EQ(replies[2].at, 708us + 118us);
}

TEST(BusTiming, MultiDriveRepliesFollowInOrderOfIds) {
  auto config = bus_config({1, 2}, kBitrate);
  config.servos[0].rom.broadcast_mode = true;
  config.servos[1].rom.broadcast_mode = true;
  Bus bus(config);
  bus.receive({0us, frame("280#0000000000000000")});
  const auto replies = run_until(bus, 1ms);
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_EQ(replies[0], (TimedFrame{123us + 100us + 118us, frame("141#A119000000000008")}));
  EXPECT_EQ(replies[1], (TimedFrame{344us + 117us, frame("142#A119000000000008")}));
}

TEST(BusTiming, CommandsTakeEffectAtTheNextTickAfterTheirLastBit) {
  Bus bus(bus_config({1}, kBitrate));
  bus.receive({1ms, frame("141#A100000064000000")});
  const auto delivered = bus.next_due();
  ASSERT_TRUE(delivered);
  // Motion loops run at every fourth tick of 31.25 µs, the first at 0.
  bus.advance_to(*delivered);
  EXPECT_EQ(bus.truth(1).i_q_ref, 0);
  bus.advance_to(*delivered + 5 * 31250ns);
  EXPECT_NEAR(bus.truth(1).i_q_ref, 1.6, 1e-9);
}

TEST(BusTiming, RepliesTakeNoTimeWithoutABitRate) {
  Bus bus(bus_config({1, 2}));
  bus.receive({3ms, frame("142#9C00000000000000")});
  bus.receive({3ms, frame("141#9C00000000000000")});
  bus.receive({5ms, frame("141#9C00000000000000")});
  EXPECT_EQ(bus.next_due(), 3ms);
  const auto replies = run_until(bus, 4ms);
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_EQ(replies[0], (TimedFrame{3ms, frame("142#9C19000000000008")}));
  EXPECT_EQ(replies[1], (TimedFrame{3ms, frame("141#9C19000000000008")}));
  EXPECT_EQ(run_until(bus, 5ms).at(0).at, 5ms);
}

TEST(BusTiming, FramesOfThePastCountAsNow) {
  Bus bus(bus_config({1}));
  bus.advance_to(1s);
  bus.receive({1ms, frame("141#9C00000000000000")});
  EXPECT_EQ(run_until(bus, 1s).at(0).at, 1s);
  bus.advance_to(1ms);
  EXPECT_EQ(bus.time(), 1s);
}

BusConfig drives_up_to(int last) {
  BusConfig config = bus_config({}, kBitrate);
  for (int id = 1; id <= last; ++id) config.servos.push_back(test::servo_config(id));
  return config;
}

// Wire load: one query and its reply take about 244 µs, so 3 drives can be polled at 1 kHz, but not
// 12.
int replies_per_second(int drives) {
  Bus bus(drives_up_to(drives));
  for (SimTime cycle = 0ms; cycle < 1s; cycle += 1ms) {
    for (int id = 1; id <= drives; ++id) {
      bus.receive(
          {cycle, protocol::encode_query(id, protocol::ReadState2{}, protocol::kLegacyFormat)});
    }
  }
  return static_cast<int>(run_until(bus, 1s).size());
}

TEST(BusTiming, ThreeDrivesCanBePolledAt1KHzTwelveCannot) {
  EXPECT_EQ(replies_per_second(3), 3000);
  const int replies = replies_per_second(12);
  EXPECT_GT(replies,
            3900);  // 2 · 132 + 6 bits a pair at most: 1 s / 270 µs = 3703; at least 222 µs: 4504
  EXPECT_LT(replies, 4504);
}

TEST(BusQueue, OverloadFillsTheHostQueueAndIsCounted) {
  Bus bus(bus_config({1}, kBitrate));
  for (int k = 0; k < 5000; ++k) {
    bus.receive({0us, kQuery});
  }
  EXPECT_EQ(bus.stats().count(Drop::kQueueFull), 5000 - HostQueue::kDefaultFrames);
  EXPECT_EQ(bus.stats().queue_peak, HostQueue::kDefaultFrames);
  EXPECT_EQ(run_until(bus, 10s).size(), HostQueue::kDefaultFrames);
}

// The queue is full only if frames still wait at the frame's own time, however far the caller runs
// ahead with receive().
TEST(BusQueue, FutureFramesDoNotOverflowTheQueue) {
  Bus bus(bus_config({1}, kBitrate));
  for (int k = 0; k < 5000; ++k) {
    bus.receive({k * 1ms, kQuery});
  }
  EXPECT_EQ(run_until(bus, 10s).size(), 5000U);
  EXPECT_EQ(bus.stats().count(Drop::kQueueFull), 0U);
}

TEST(BusDrops, EveryCauseIsCounted) {
  Bus bus(bus_config({1, 3}, kBitrate));
  auto error = kQuery;
  error.kind = protocol::FrameKind::kError;
  auto fd = kQuery;
  fd.kind = protocol::FrameKind::kFd;
  bus.receive({0us, error});
  bus.receive({0us, fd});
  EXPECT_EQ(bus.next_due(), std::nullopt);  // neither occupies the wire
  for (const char* text :
       {"141#R", "00000141#9A00000000000000", "140#9A00000000000000", "142#9A00000000000000",
        "141#9A", "141#0000000000000000", "142#0000000000000000", "280#0000000000000000",
        "141#9A00000000000000"}) {
    bus.receive({0us, frame(text)});
  }
  EXPECT_EQ(run_until(bus, 1s).size(), 1U);
  const BusStats stats = bus.stats();
  for (const Drop drop :
       {Drop::kErrorFrame, Drop::kCanFd, Drop::kRemote, Drop::kExtended, Drop::kForeignId,
        Drop::kNoSuchDrive, Drop::kWrongLength, Drop::kUnknownCommand, Drop::kWrongMode}) {
    EXPECT_EQ(stats.count(drop), drop == Drop::kNoSuchDrive ? 2U : 1U) << to_string(drop);
  }
  EXPECT_EQ(stats.frames, 11U);
  EXPECT_EQ(stats.queries, 1U);
  EXPECT_EQ(stats.replies, 1U);
  EXPECT_EQ(std::accumulate(stats.dropped.begin(), stats.dropped.end(), stats.queries),
            stats.frames);
}

TEST(BusDrops, CausesHaveNames) {
  for (std::size_t k = 0; k < protocol::kRejects; ++k) {
    EXPECT_GT(to_string(static_cast<Drop>(k)).size(), 3U);
  }
}

TEST(Bus, WithoutDrivesCountsAndDropsFrames) {
  BusConfig config = bus_config({}, kBitrate);
  config.always_acknowledged = true;
  Bus bus(config);
  bus.receive({0us, kQuery});
  bus.receive({0us, frame("280#0000000000000000")});
  bus.receive({0us, frame("281#0000000000000000")});
  EXPECT_TRUE(run_until(bus, 1s).empty());
  EXPECT_EQ(bus.size(), 0U);
  EXPECT_FALSE(bus.has(1));
  // No drive lacks power: none is in the mode for 0x280, and none has the other command.
  EXPECT_EQ(bus.stats().count(Drop::kNoPower), 0U);
  EXPECT_EQ(bus.stats().count(Drop::kNoSuchDrive), 1U);
  EXPECT_EQ(bus.stats().count(Drop::kWrongMode), 1U);
  EXPECT_EQ(bus.stats().count(Drop::kForeignId), 1U);
}

TEST(Bus, ThirtyTwoDrivesReply) {
  Bus bus(drives_up_to(32));
  for (int id = 32; id >= 1; --id) {
    bus.receive({0us, protocol::encode_query(id, protocol::ReadState1{}, protocol::kLegacyFormat)});
  }
  EXPECT_EQ(run_until(bus, 1s).size(), 32U);
  EXPECT_EQ(bus.size(), 32U);
  EXPECT_TRUE(bus.has(1) && bus.has(32));
  for (const int id : {-1, 0, 33, 1'000'000}) EXPECT_FALSE(bus.has(id)) << id;
}

/// A host may query before the first control tick: it reads 24.0 V and 25 °C then as well.
TEST(Bus, RepliesAtTimeZeroAndHandsEachReplyOutOnce) {
  Bus bus(bus_config({1}));
  bus.receive({0us, kQuery});
  bus.advance_to(0us);
  std::vector<TimedFrame> replies(1);
  bus.take_replies(replies);
  ASSERT_EQ(replies.size(), 2U);  // appended
  EXPECT_EQ(replies[1].frame, kReply);
  bus.take_replies(replies);
  EXPECT_EQ(replies.size(), 2U);
}

TEST(Golden, RestingDrive) {
  const test::GoldenTrace trace = test::golden_trace("resting_drive.log");
  ASSERT_GT(trace.expected.size(), 26U);
  Bus bus(test::resting_drive());
  for (const TimedFrame& sent : trace.sent) bus.receive(sent);
  const auto replies = run_until(bus, 1s);
  ASSERT_EQ(replies.size(), trace.expected.size());
  for (std::size_t k = 0; k < replies.size(); ++k) {
    EXPECT_EQ(replies[k].at, trace.expected[k].at);
    EXPECT_EQ(replies[k].frame, trace.expected[k].frame);
  }
}

}  // namespace bus_test
}  // namespace lk::emulator
