// Faults of the link on a drive's input and output, as a host observes them.

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <set>
#include <tuple>

#include "tests/emulator/core/faults/link_support.hpp"

namespace lk::emulator {
namespace link_faults_test {

// --- drop, corrupt

std::vector<bool> lost_replies(std::uint64_t seed) {
  BusConfig config = bus_config({1});
  config.seed = seed;
  Rig rig(config);
  rig.set(fault("drop", {1}, {kReplies}, 0.1));
  std::vector<bool> lost;
  for (int n = 0; n < 10'000; ++n) lost.push_back(rig.talk(kState2).empty());
  const auto count = static_cast<std::uint64_t>(std::ranges::count(lost, true));
  EXPECT_EQ(rig.effects(), count);
  EXPECT_EQ(rig.bus.stats().replies_lost, count);
  expect_balanced(rig.bus, rig.seen, "drop");
  return lost;
}

TEST(LinkFaults, DropFollowsItsProbabilityAndTheSeed) {
  const auto lost = lost_replies(1);
  const double sigma = std::sqrt(10'000 * 0.1 * 0.9);
  EXPECT_NEAR(static_cast<double>(std::ranges::count(lost, true)), 1000, 5 * sigma);
  EXPECT_EQ(lost_replies(1), lost);
  EXPECT_NE(lost_replies(2), lost);
}

TEST(LinkFaults, DroppedQueryIsNotExecutedAndDroppedReplyIs) {
  for (const Frames frames : {kReplies, kQueries, kBoth}) {
    Rig rig(bus_config({1, 2}));
    rig.set(fault("drop", {1}, {frames}));
    EXPECT_TRUE(rig.talk(kTorque, 10ms).empty());
    EXPECT_EQ(rig.bus.truth(1).i_q_ref != 0, frames == kReplies);
    EXPECT_EQ(rig.dropped(Drop::kFault), frames == kReplies ? 0U : 1U);
    EXPECT_EQ(rig.effects(), 1U);
    EXPECT_EQ(rig.talk("142#9C00000000000000").size(), 1U) << "the other drive";
    rig.clear();
    EXPECT_EQ(rig.talk(kState2).size(), 1U);
    EXPECT_EQ(rig.effects(), 1U);
  }
}

TEST(LinkFaults, MultiDriveFrameIsChangedPerDrive) {
  BusConfig config = bus_config({1, 2, 3});
  for (auto& servo : config.servos) servo.rom.broadcast_mode = true;
  Rig rig(config);
  rig.set(fault("drop", {1}, {kQueries}));
  rig.set(fault("corrupt", {2}, {64, kQueries}));
  // 100 to each of four drives; drive 2 receives the complement, -101.
  EXPECT_EQ(rig.talk("280#6400640064006400", 5ms).size(), 2U);
  EXPECT_EQ(rig.bus.truth(1).i_q_ref, 0);
  EXPECT_LT(rig.bus.truth(2).i_q_ref, -1);
  EXPECT_GT(rig.bus.truth(3).i_q_ref, 1);
  EXPECT_EQ(rig.bus.stats().queries, 1U);
}

TEST(LinkFaults, MultiDriveFrameIsUnaffectedWithoutBroadcastMode) {
  BusConfig config = bus_config({1, 2});
  config.servos[0].rom.broadcast_mode = true;
  for (const Fault& made :
       {fault("drop", {2}, {kQueries}), fault("corrupt", {2}, {64, kQueries})}) {
    Rig rig(config);
    rig.set(made);
    EXPECT_EQ(rig.talk("280#6400640064006400", 5ms).size(), 1U);
    EXPECT_EQ(rig.effects(), 0U);
  }
}

int differing_bits(const Frame& a, const Frame& b) {
  int bits = 0;
  for (std::size_t n = 0; n < 8; ++n) {
    bits += std::popcount(static_cast<unsigned>(a.data[n] ^ b.data[n]));
  }
  return bits;
}

TEST(LinkFaults, CorruptFlipsTheNumberOfBits) {
  for (const int bits : {1, 3, 63, 64}) {
    Rig rig(bus_config({1}));
    rig.set(fault("corrupt", {1}, {static_cast<double>(bits), kReplies}));
    std::set<protocol::Payload> different;
    for (int n = 0; n < 20; ++n) {
      const auto replies = rig.talk(kState2);
      ASSERT_EQ(replies.size(), 1U);
      EXPECT_EQ(replies[0].id, 0x141U);
      EXPECT_EQ(differing_bits(replies[0], kState2Answer), bits);
      different.insert(replies[0].data);
    }
    EXPECT_EQ(different.size() > 1, bits < 64);
    EXPECT_EQ(rig.effects(), 20U);
  }
}

TEST(LinkFaults, CorruptQueryIsAnotherQuery) {
  Rig rig(bus_config({1}));
  rig.set(fault("corrupt", {1}, {64, kQueries}));
  EXPECT_TRUE(rig.talk(kAsk).empty());  // 0x65 is not a command
  EXPECT_EQ(rig.dropped(Drop::kUnknownCommand), 1U);
  EXPECT_EQ(rig.talk("141#63FFFFFFFFFFFFFF").at(0), kState2Answer);  // complement of 9C00…
}

// --- delay, duplicate, stale, reorder

TEST(LinkFaults, DelayStaysWithinItsBoundsAndKeepsTheOrder) {
  Rig rig(bus_config({1}));
  rig.set(fault("delay", {1}, {5, 4}));
  double sum_ms = 0;
  for (int n = 0; n < 200; ++n) {
    const SimTime sent_at = rig.bus.time();
    ASSERT_EQ(rig.talk(kState2, 20ms).size(), 1U);
    const SimTime late = rig.seen.back().at - sent_at;
    EXPECT_GE(late, 5ms);
    EXPECT_LE(late, 9ms);
    sum_ms += std::chrono::duration<double, std::milli>(late).count();
  }
  // Mean of 200 draws with a standard deviation of 4/√12 ms each.
  EXPECT_NEAR(sum_ms / 200, 7, 5 * 4 / std::sqrt(12.0 * 200));

  std::vector<std::uint8_t> sent;
  std::vector<std::uint8_t> answered;
  const std::size_t before = rig.seen.size();
  for (int n = 0; n < 200; ++n) {  // ten pending at once
    const Frame query = mixed_query(n);
    sent.push_back(query.data[0]);
    rig.talk(query, 1ms);
  }
  rig.wait(20ms);
  for (std::size_t n = before; n < rig.seen.size(); ++n) {
    answered.push_back(rig.seen[n].frame.data[0]);
  }
  EXPECT_EQ(answered, sent);
  EXPECT_EQ(rig.effects(), 400U);
  rig.clear();
  EXPECT_EQ(rig.talk(kState2).size(), 1U);
}

TEST(LinkFaults, DelayOfZeroHasNoEffect) {
  Rig rig(bus_config({1}));
  rig.set(fault("delay", {1}, {0, 0}));
  EXPECT_EQ(rig.talk(kState2).size(), 1U);
  EXPECT_EQ(rig.effects(), 0U);
}

TEST(LinkFaults, DuplicatesFollowOnTheWire) {
  Rig rig(bus_config({1}, kBitrate));
  rig.set(fault("duplicate", {1}, {2}));
  EXPECT_EQ(rig.talk(kAsk, 2ms), (std::vector<Frame>{kAnswer, kAnswer, kAnswer}));
  EXPECT_EQ(rig.seen[0].at, 338us);
  EXPECT_EQ(rig.seen[1].at, 338us + 121us);
  EXPECT_EQ(rig.seen[2].at, 338us + 242us);
  EXPECT_EQ(rig.bus.stats().wire_busy, 123us + 3 * 121us);
  EXPECT_EQ(rig.bus.stats().extra_frames, 2U);
  EXPECT_EQ(rig.effects(), 1U);
}

TEST(LinkFaults, DuplicatesOfDuplicatesStayWithinTheQueue) {
  Rig rig(bus_config({1}));
  rig.set(fault("duplicate", {1}, {15}));
  rig.set(fault("duplicate", {1}, {15}));
  EXPECT_EQ(rig.talk(kState2).size(), 16U);
  EXPECT_EQ(rig.bus.stats().extra_frames, 15U + 16 * 15U);
  EXPECT_EQ(rig.bus.stats().replies_lost, 16U * 15);
  expect_balanced(rig.bus, rig.seen, "copies");
}

TEST(LinkFaults, ActInTheOrderInWhichTheyWereSet) {
  for (const bool copy_first : {true, false}) {
    Rig rig(bus_config({1}));
    const Fault corrupt = fault("corrupt", {1}, {3, kReplies});
    const Fault copy = fault("duplicate", {1}, {1});
    rig.set(copy_first ? copy : corrupt);
    rig.set(copy_first ? corrupt : copy);
    rig.set(fault("delay", {1}, {2, 0}));
    EXPECT_TRUE(rig.talk(kState2, 2ms - 1ns).empty());
    const auto replies = rig.wait(1ns);
    ASSERT_EQ(replies.size(), 2U);
    EXPECT_EQ(differing_bits(replies[0], kState2Answer), 3);
    EXPECT_EQ(replies[0] == replies[1], !copy_first) << "a copy of its own, or of the damage";
  }
}

TEST(LinkFaults, StaleRepeatsTheLastReply) {
  Rig rig(bus_config({1, 2}));
  rig.set(fault("stale", {2}));
  EXPECT_EQ(rig.talk("142#9C00000000000000").at(0).data[0], 0x9C) << "nothing to repeat";
  EXPECT_EQ(rig.effects(0), 0U);
  rig.talk(kAsk);
  rig.set(fault("stale", {1}));
  EXPECT_EQ(rig.talk(kState2).at(0), kAnswer);
  EXPECT_EQ(rig.talk(kState2).at(0), kAnswer);
  EXPECT_EQ(rig.talk(kAsk).at(0), kAnswer);  // as without the fault
  EXPECT_EQ(rig.effects(1), 2U);
  rig.clear();
  EXPECT_EQ(rig.talk(kState2).at(0), kState2Answer);
}

TEST(LinkFaults, ReorderSwapsNeighbours) {
  Rig rig(bus_config({1}));
  rig.set(fault("reorder", {1}));
  std::string order;
  for (const char* text : {"141#9A00000000000000", "141#9C00000000000000", "141#9000000000000000",
                           "141#9200000000000000", "141#3000000000000000"}) {
    for (const Frame& reply : rig.talk(frame(text))) {
      order += std::to_string(reply.data[0]) + ' ';
    }
  }
  EXPECT_EQ(order, "156 154 146 144 ");
  EXPECT_EQ(rig.bus.stats().replies_waiting, 1U);
  rig.clear();
  EXPECT_EQ(rig.wait(0ns).at(0).data[0], 0x30) << "what is held back leaves at the end";
  EXPECT_EQ(rig.effects(), 3U);
  expect_balanced(rig.bus, rig.seen, "reorder");
}

// --- contents of the frame

TEST(LinkFaults, TornReplyHasTheLowByteOfTheOneBefore) {
  constexpr double kCount_deg = 360.0 / 16384;
  test::Host host(test::servo_config(1));
  const auto turn = [&](int counts) {
    host.bus.apply({1, TurnShaft{counts * kCount_deg}});
    host.wait(1ms);
  };
  const auto expect_counts = [&](int counts, std::uint64_t effects) {
    EXPECT_EQ(host.state_2().encoder_counts, counts);
    EXPECT_EQ(host.bus.faults()[0].evidence.effects, effects) << counts;
  };
  turn(255);
  host.bus.apply({kWholeBus, SetFault{fault("torn_reply", {1}, {static_cast<FaultChoice>(2)})}});
  expect_counts(0x08FF, 0);
  expect_counts(0x08FF, 0);  // equal replies
  turn(1);
  expect_counts(0x09FF, 1);  // 0x0900
  expect_counts(0x0900, 1);
  turn(-1);
  expect_counts(0x0800, 2);  // 0x08FF
  // Other replies, and later ones, are not torn.
  host.get<protocol::MultiTurnAngle>(protocol::ReadMultiTurnAngle{});
  expect_counts(0x08FF, 2);
}

TEST(LinkFaults, BootGarbageIsSentUntilTheFirstReply) {
  Rig rig(bus_config({1}));
  rig.wait(1s);
  rig.set(fault("boot_garbage", {1}, {100}));
  EXPECT_TRUE(rig.wait(500ms).empty());  // started long ago
  const SimTime started = rig.bus.time();
  rig.bus.power_cycle(1);
  const auto garbage = rig.wait(300ms);
  EXPECT_GE(garbage.size(), 5U);   // 100 ms, at most 20 ms apart
  EXPECT_LE(garbage.size(), 20U);  // at least 5 ms apart
  SimTime before = started - 5ms;
  std::set<int> lengths;
  for (std::size_t n = 0; n < garbage.size(); ++n) {
    EXPECT_EQ(garbage[n].id, 0x141U);
    EXPECT_LE(garbage[n].dlc, 7);
    lengths.insert(garbage[n].dlc);
    EXPECT_LE(rig.seen[n].at - started, 100ms);
    if (n > 0) {
      EXPECT_GE(rig.seen[n].at - before, 5ms);
    }
    EXPECT_LE(rig.seen[n].at - before, 25ms);
    before = rig.seen[n].at;
  }
  EXPECT_GT(lengths.size(), 1U);
  EXPECT_EQ(rig.effects(), garbage.size());
  rig.bus.power_cycle(1);
  rig.wait(1ms);
  EXPECT_EQ(rig.talk(kState2).size(), 1U);
  EXPECT_TRUE(rig.wait(100ms).empty());
  expect_balanced(rig.bus, rig.seen, "garbage at boot");
}

TEST(LinkFaults, WrongBitrateDestroysSixteenFramesAndGetsNone) {
  Rig rig(bus_config({1, 2}, kBitrate));
  rig.set(fault("wrong_bitrate", {2}));
  const auto frames = rig.talk(kAsk, 10ms);
  ASSERT_EQ(frames.size(), 17U);
  for (std::size_t n = 0; n < 16; ++n) EXPECT_EQ(frames[n].kind, FrameKind::kError);
  EXPECT_EQ(frames[16], kAnswer);
  EXPECT_EQ(rig.effects(), 16U);
  EXPECT_TRUE(rig.talk("142#9A00000000000000", 10ms).empty());
  EXPECT_EQ(rig.effects(), 17U);
  EXPECT_EQ(rig.dropped(Drop::kFault), 1U);
  rig.clear();
  EXPECT_EQ(rig.talk("142#9A00000000000000", 10ms).size(), 1U);
  expect_balanced(rig.bus, rig.seen, "another bit rate");
}

TEST(LinkFaults, WrongBitrateIsSilentWithoutFrameTimes) {
  Rig rig(bus_config({1, 2}));
  rig.set(fault("wrong_bitrate", {2}));
  EXPECT_EQ(rig.talk(kAsk), std::vector<Frame>{kAnswer});
  EXPECT_TRUE(rig.talk("142#9A00000000000000").empty());
}

/// Missing resistors, metres, bit/s, and the share of frames: p1 (rate / 1 M)^2 cable / 2 m, p1 =
/// 0.01 with one missing and 0.5 with both.
TEST(LinkFaults, MissingTerminationDestroysFramesByTheSquareOfTheRate) {
  using Case = std::tuple<double, double, std::int64_t, double>;
  for (const auto& [missing, cable_m, bitrate, share] :
       {Case{1, 2, 1'000'000, 0.01}, Case{1, 10, 1'000'000, 0.05}, Case{2, 0.2, 1'000'000, 0.05},
        Case{2, 2, 125'000, 0.0078125}}) {
    Rig rig(bus_config({1}, bitrate));
    rig.set(fault("no_termination", {}, {missing, cable_m}));
    for (int n = 0; n < 2000; ++n) rig.talk(kState2, 8ms);
    const auto destroyed = static_cast<double>(rig.effects());
    const double mean = 4000 * share / (1 - share);  // failures before 4000 successes
    EXPECT_NEAR(destroyed, mean, 5 * std::sqrt(mean / (1 - share))) << missing << ' ' << bitrate;
    EXPECT_EQ(rig.bus.stats().replies, 2000U);
    expect_balanced(rig.bus, rig.seen, "no termination");
  }
  Rig rig(bus_config({1}, kBitrate));
  rig.set(fault("no_termination", {}, {2, 4}));  // no frame succeeds
  rig.talk(kState2, 20ms);
  EXPECT_EQ(rig.bus.stats().queries, 0U);
  EXPECT_GE(rig.effects(), 32U);
}

TEST(LinkFaults, WrongDlcShortensTheReply) {
  Rig rig(bus_config({1}));
  rig.set(fault("wrong_dlc", {1}, {4}));
  EXPECT_EQ(rig.talk(kState2).at(0), frame("141#9C190000"));
  rig.set(fault("wrong_dlc", {1}, {0}));
  EXPECT_EQ(rig.talk(kState2).at(0), frame("141#"));
  EXPECT_EQ(rig.effects(0), 2U);
}

TEST(LinkFaults, WrongIdentifierIsModulo2048AndKeepsTheDrive) {
  Rig rig(bus_config({1, 2}));
  rig.set(fault("wrong_id", {1}, {1}));
  Frame expected = kState2Answer;
  expected.id = 0x142;
  EXPECT_EQ(rig.talk(kState2).at(0), expected);
  EXPECT_EQ(rig.seen[0].drive_id, 1);
  rig.clear();
  rig.set(fault("wrong_id", {1}, {-0x142}));
  EXPECT_EQ(rig.talk(kState2).at(0).id, 0x7FFU);
  rig.clear();
  EXPECT_EQ(rig.talk(kState2).at(0), kState2Answer);
  EXPECT_EQ(rig.seen.back().drive_id, 0);
}

TEST(LinkFaults, AcknowledgementsKeepTheirTags) {
  Rig rig(bus_config({1}));
  rig.set(fault("duplicate", {1}, {1}));
  rig.set(fault("reorder", {1}));
  rig.set(fault("wrong_id", {1}, {5}));
  std::vector<std::uint64_t> tags;
  for (const char* text :
       {"141#9100000000000000", "141#9C00000000000000", "141#9100000000010000"}) {
    rig.talk(frame(text));
  }
  for (const TimedFrame& one : rig.seen) tags.push_back(one.after_rom_write);
  // The original of the second is delayed: its copy leaves, and the original follows the third.
  EXPECT_EQ(tags, (std::vector<std::uint64_t>{1, 1, 0, 2, 0, 2}));
}

// --- a second drive

const Frame kReadEncoder = frame("141#9000000000000000");

std::uint16_t encoder(const Frame& reply) {
  const auto decoded = protocol::decode_reply(reply, protocol::kLegacyFormat);
  const auto* content = std::get_if<protocol::ReplyFrame>(&decoded);
  const auto* read = content ? std::get_if<protocol::Encoder>(&content->reply) : nullptr;
  return read ? read->encoder_counts : std::uint16_t{0xFFFF};
}

TEST(LinkFaults, SecondDriveHasItsOwnMotor) {
  Rig rig(bus_config({1}));
  rig.wait(10ms);
  rig.set(fault("duplicate_id", {1}, {90}));
  auto replies = rig.talk(kReadEncoder, 10ms);
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_EQ(replies[0].id, 0x141U);
  EXPECT_EQ(replies[1].id, 0x141U);
  EXPECT_NEAR(encoder(replies[0]), 16384.0 * 45 / 360, 1);  // a count covers [n, n + 1)
  EXPECT_NEAR(encoder(replies[1]), 16384.0 * 135 / 360, 1);
  EXPECT_EQ(rig.talk("141#A2000000A0860100", 500ms).size(), 2U);  // 1000 dps
  replies = rig.talk(kReadEncoder);
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_GT(std::abs(encoder(replies[1]) - 6144), 100) << "it turns too";
  EXPECT_EQ(rig.effects(), 3U);
  EXPECT_EQ(rig.bus.stats().extra_frames, 3U);
  rig.clear();
  EXPECT_EQ(rig.talk(kReadEncoder).size(), 1U);
  expect_balanced(rig.bus, rig.seen, "second drive");
}

/// docs/reference/events.md: it boots at an offset from the drive's boot angle. That angle belongs
/// to the shaft, even if another zero was written since (docs/reference/configuration.md).
TEST(LinkFaults, SecondDriveBootsAtTheAngleOfTheShaft) {
  Rig rig(bus_config({1}));
  const auto raw = [](const Frame& reply) { return reply.data[4] + 256 * reply.data[5]; };
  const int before = raw(rig.talk(kReadEncoder, 10ms).at(0));
  rig.talk("141#9100000000001027", 10ms);
  rig.set(fault("duplicate_id", {1}, {0}));
  const auto replies = rig.talk(kReadEncoder, 10ms);
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_EQ(raw(replies[0]), before);
  EXPECT_EQ(raw(replies[1]), before);
}

TEST(LinkFaults, SecondDriveIgnoresTheSameFrames) {
  Rig rig(bus_config({1}));
  rig.set(fault("duplicate_id", {1}, {90}));
  for (const char* text :
       {"7FF#9C00000000000000", "00000141#9C00000000000000", "141#R8", "141#9C",
        "142#9C00000000000000", "280#0000000000000000", "141#0000000000000000"}) {
    EXPECT_TRUE(rig.talk(frame(text), 1ms).empty()) << text;
  }
  EXPECT_EQ(rig.effects(), 0U);
  EXPECT_EQ(rig.talk(kState2, 1ms).size(), 2U);
  expect_balanced(rig.bus, rig.seen, "second drive");
}

/// Reply identifiers above those of the queries: the replies wait until the queries stop.
TEST(LinkFaults, SecondDriveHasAQueueOfSixteen) {
  BusConfig config = bus_config({1}, kBitrate);
  config.servos[0].quirks.dialect.reply_id_base = 0x240;
  Rig rig(config);
  rig.set(fault("duplicate_id", {1}, {90}));
  for (int n = 0; n < 40; ++n) rig.bus.receive({0ns, kState2});
  EXPECT_EQ(rig.wait(100ms).size(), 32U);
  EXPECT_EQ(rig.dropped(Drop::kDriveBusy), 24U);
  EXPECT_EQ(rig.bus.stats().extra_frames, 16U);
  EXPECT_EQ(rig.effects(), 16U);
  EXPECT_EQ(rig.talk(kState2, 2ms).size(), 2U);
  expect_balanced(rig.bus, rig.seen, "second drive's queue");
}

TEST(LinkFaults, SecondReplyTakesTimeOnTheWire) {
  Rig rig(bus_config({1}, kBitrate));
  rig.set(fault("duplicate_id", {1}, {0}));
  EXPECT_EQ(rig.talk(kAsk, 2ms), (std::vector<Frame>{kAnswer, kAnswer}));
  EXPECT_EQ(rig.seen[0].at, 338us);
  EXPECT_EQ(rig.seen[1].at, 341us + 118us);
  // If the drive gets no queries, only the second drive's replies remain.
  rig.set(fault("drop", {1}, {kQueries}));
  EXPECT_EQ(rig.talk(kAsk, 2ms).size(), 1U);
}

}  // namespace link_faults_test
}  // namespace lk::emulator
