// Faults of the link, as a host sees them. Lengths counted by hand in can_wire_test.cpp and
// bus_test.cpp: the query 141#9A00… has 120 bits, its reply 141#9A1900F0… 118, the query 142#9A00…
// 119; 3 bits of intermission follow each. An error frame: 8 bits of delimiter and 3 of
// intermission behind the flags, which end where the frame would have ended.

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>
#include <set>

#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace {

using namespace std::chrono_literals;
using protocol::Frame;
using protocol::FrameKind;
using test::bus_config;
using test::frame;
using K = FaultKind;

constexpr std::int64_t kBitrate = 1'000'000;
const Frame kAsk = frame("141#9A00000000000000");
const Frame kAnswer = frame("141#9A1900F000000000");
const Frame kState2 = frame("141#9C00000000000000");
const Frame kState2Answer = frame("141#9C19000000000008");
const Frame kTorque = frame("141#A100000064000000");
constexpr double kReplies = 0, kQueries = 1, kBoth = 2;

Fault fault(K kind, std::vector<int> ids, std::array<double, kMostFaultParams> values = {},
            double probability = 1) {
  Fault made;
  made.kind = kind;
  made.ids = std::move(ids);
  made.values = values;
  made.probability = probability;
  return made;
}

/// A bus, faults set and cleared at will, and what has come back.
struct Rig {
  explicit Rig(const BusConfig& config) : bus(config) {}

  void set(const Fault& made) { bus.apply({kWholeBus, SetFault{made}}); }
  void clear() { bus.apply({kWholeBus, ClearFault{"all"}}); }
  /// A query now, and what comes back within `window`.
  std::vector<Frame> talk(const Frame& query, SimTime window = 0ns) {
    bus.receive({bus.time(), query});
    return wait(window);
  }
  std::vector<Frame> wait(SimTime window) {
    bus.advance_to(bus.time() + window);
    std::vector<Frame> frames;
    const std::size_t before = seen.size();
    bus.take_replies(seen);
    for (std::size_t n = before; n < seen.size(); ++n) frames.push_back(seen[n].frame);
    return frames;
  }
  std::uint64_t effects(std::size_t index = 0) { return bus.faults()[index].evidence.effects; }
  std::uint64_t dropped(Drop cause) { return bus.stats().count(cause); }

  Bus bus;
  std::vector<TimedFrame> seen;
};

void expect_balanced(const Bus& bus, const std::vector<TimedFrame>& seen, const char* what) {
  const BusStats stats = bus.stats();
  std::uint64_t dropped = 0;
  for (const std::uint64_t count : stats.dropped) dropped += count;
  EXPECT_EQ(stats.frames, stats.queries + dropped + stats.frames_waiting) << what;
  std::uint64_t given = 0;
  for (int id = protocol::kMinId; id <= protocol::kMaxId; ++id) {
    if (bus.has(id)) given += bus.servo(id).stats().replies;
  }
  EXPECT_EQ(given + stats.extra_frames, stats.replies + stats.replies_lost + stats.replies_waiting)
      << what;
  const auto errors = std::ranges::count_if(
      seen, [](const TimedFrame& one) { return one.frame.kind == FrameKind::kError; });
  EXPECT_EQ(stats.error_frames, static_cast<std::uint64_t>(errors)) << what;
  EXPECT_EQ(stats.replies, seen.size() - static_cast<std::size_t>(errors)) << what;
}

// --- drop, corrupt
// ----------------------------------------------------------------------------------------------

std::vector<bool> lost_replies(std::uint64_t seed) {
  BusConfig config = bus_config({1});
  config.seed = seed;
  Rig rig(config);
  rig.set(fault(K::kDrop, {1}, {kReplies}, 0.1));
  std::vector<bool> lost;
  for (int n = 0; n < 10'000; ++n) lost.push_back(rig.talk(kState2).empty());
  const auto count = static_cast<std::uint64_t>(std::ranges::count(lost, true));
  EXPECT_EQ(rig.effects(), count);
  EXPECT_EQ(rig.bus.stats().replies_lost, count);
  expect_balanced(rig.bus, rig.seen, "drop");
  return lost;
}

TEST(LinkFaults, DropsAsOftenAsItsProbabilityAndTheSeedDecidesWhich) {
  const auto lost = lost_replies(1);
  const double sigma = std::sqrt(10'000 * 0.1 * 0.9);
  EXPECT_NEAR(static_cast<double>(std::ranges::count(lost, true)), 1000, 5 * sigma);
  EXPECT_EQ(lost_replies(1), lost);
  EXPECT_NE(lost_replies(2), lost);
}

TEST(LinkFaults, ALostQueryMovesNothingAndALostReplyDoes) {
  for (const double frames : {kReplies, kQueries, kBoth}) {
    Rig rig(bus_config({1, 2}));
    rig.set(fault(K::kDrop, {1}, {frames}));
    EXPECT_TRUE(rig.talk(kTorque, 10ms).empty());
    EXPECT_EQ(rig.bus.truth(1).i_q_ref != 0, frames == kReplies);
    EXPECT_EQ(rig.dropped(Drop::kFault), frames == kReplies ? 0U : 1U);
    EXPECT_EQ(rig.effects(), 1U);
    EXPECT_EQ(rig.talk(frame("142#9C00000000000000")).size(), 1U) << "the other drive";
    rig.clear();
    EXPECT_EQ(rig.talk(kState2).size(), 1U);
    EXPECT_EQ(rig.effects(), 1U);
  }
}

TEST(LinkFaults, EachDriveHearsAFrameForSeveralInItsOwnWay) {
  BusConfig config = bus_config({1, 2, 3});
  for (auto& servo : config.servos) servo.rom.broadcast_mode = true;
  Rig rig(config);
  rig.set(fault(K::kDrop, {1}, {kQueries}));
  rig.set(fault(K::kCorrupt, {2}, {64, kQueries}));
  // 100 to each of four drives; drive 2 hears the complement, -101.
  EXPECT_EQ(rig.talk(frame("280#6400640064006400"), 5ms).size(), 2U);
  EXPECT_EQ(rig.bus.truth(1).i_q_ref, 0);
  EXPECT_LT(rig.bus.truth(2).i_q_ref, -1);
  EXPECT_GT(rig.bus.truth(3).i_q_ref, 1);
  EXPECT_EQ(rig.bus.stats().queries, 1U);
}

int differing_bits(const Frame& a, const Frame& b) {
  int bits = 0;
  for (std::size_t n = 0; n < 8; ++n) {
    bits += std::popcount(static_cast<unsigned>(a.data[n] ^ b.data[n]));
  }
  return bits;
}

TEST(LinkFaults, CorruptFlipsSoManyBits) {
  for (const int bits : {1, 3, 63, 64}) {
    Rig rig(bus_config({1}));
    rig.set(fault(K::kCorrupt, {1}, {static_cast<double>(bits), kReplies}));
    std::set<std::array<std::uint8_t, 8>> different;
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

TEST(LinkFaults, ACorruptQueryIsAnotherQuery) {
  Rig rig(bus_config({1}));
  rig.set(fault(K::kCorrupt, {1}, {64, kQueries}));
  EXPECT_TRUE(rig.talk(kAsk).empty());  // 0x65 is no command
  EXPECT_EQ(rig.dropped(Drop::kUnknownCommand), 1U);
  EXPECT_EQ(rig.talk(frame("141#63FFFFFFFFFFFFFF")).at(0),
            kState2Answer);  // the complement of 9C00…
}

// --- delay, duplicate, stale, reorder
// ---------------------------------------------------------------------------

TEST(LinkFaults, DelayStaysInItsBoundsAndKeepsTheOrder) {
  Rig rig(bus_config({1}));
  rig.set(fault(K::kDelay, {1}, {5, 4}));
  double sum_ms = 0;
  for (int n = 0; n < 200; ++n) {
    const SimTime asked = rig.bus.time();
    ASSERT_EQ(rig.talk(kState2, 20ms).size(), 1U);
    const SimTime late = rig.seen.back().at - asked;
    EXPECT_GE(late, 5ms);
    EXPECT_LE(late, 9ms);
    sum_ms += std::chrono::duration<double, std::milli>(late).count();
  }
  // The mean of 200 draws, each of a standard deviation of 4/√12 ms.
  EXPECT_NEAR(sum_ms / 200, 7, 5 * 4 / std::sqrt(12.0 * 200));

  std::vector<std::uint8_t> asked, answered;
  const std::size_t before = rig.seen.size();
  for (int n = 0; n < 200; ++n) {  // ten on their way at once
    Frame query = kState2;
    query.data[0] = n % 3 == 0 ? 0x9A : n % 3 == 1 ? 0x9C : 0x92;
    asked.push_back(query.data[0]);
    rig.talk(query, 1ms);
  }
  rig.wait(20ms);
  for (std::size_t n = before; n < rig.seen.size(); ++n) {
    answered.push_back(rig.seen[n].frame.data[0]);
  }
  EXPECT_EQ(answered, asked);
  EXPECT_EQ(rig.effects(), 400U);
  rig.clear();
  EXPECT_EQ(rig.talk(kState2).size(), 1U);
}

TEST(LinkFaults, CopiesFollowOnTheWire) {
  Rig rig(bus_config({1}, kBitrate));
  rig.set(fault(K::kDuplicate, {1}, {2}));
  EXPECT_EQ(rig.talk(kAsk, 2ms), (std::vector<Frame>{kAnswer, kAnswer, kAnswer}));
  EXPECT_EQ(rig.seen[0].at, 338us);
  EXPECT_EQ(rig.seen[1].at, 338us + 121us);
  EXPECT_EQ(rig.seen[2].at, 338us + 242us);
  EXPECT_EQ(rig.bus.stats().wire_busy, 123us + 3 * 121us);
  EXPECT_EQ(rig.bus.stats().extra_frames, 2U);
  EXPECT_EQ(rig.effects(), 1U);
}

TEST(LinkFaults, CopiesOfCopiesStayWithinTheQueue) {
  Rig rig(bus_config({1}));
  rig.set(fault(K::kDuplicate, {1}, {15}));
  rig.set(fault(K::kDuplicate, {1}, {15}));
  EXPECT_EQ(rig.talk(kState2).size(), 16U);
  EXPECT_EQ(rig.bus.stats().extra_frames, 15U + 16 * 15U);
  EXPECT_EQ(rig.bus.stats().replies_lost, 16U * 15);
  expect_balanced(rig.bus, rig.seen, "copies");
}

TEST(LinkFaults, FaultsActInTheOrderInWhichTheyWereSet) {
  for (const bool copy_first : {true, false}) {
    Rig rig(bus_config({1}));
    const Fault corrupt = fault(K::kCorrupt, {1}, {3, kReplies});
    const Fault copy = fault(K::kDuplicate, {1}, {1});
    rig.set(copy_first ? copy : corrupt);
    rig.set(copy_first ? corrupt : copy);
    rig.set(fault(K::kDelay, {1}, {2, 0}));
    EXPECT_TRUE(rig.talk(kState2, 2ms - 1ns).empty());
    const auto replies = rig.wait(1ns);
    ASSERT_EQ(replies.size(), 2U);
    EXPECT_EQ(differing_bits(replies[0], kState2Answer), 3);
    EXPECT_EQ(replies[0] == replies[1], !copy_first) << "a copy of its own, or of the damage";
  }
}

TEST(LinkFaults, StaleRepeatsWhatWasSaidLast) {
  Rig rig(bus_config({1, 2}));
  rig.set(fault(K::kStale, {2}));
  EXPECT_EQ(rig.talk(frame("142#9C00000000000000")).at(0).data[0], 0x9C) << "nothing to repeat";
  EXPECT_EQ(rig.effects(0), 0U);
  rig.talk(kAsk);
  rig.set(fault(K::kStale, {1}));
  EXPECT_EQ(rig.talk(kState2).at(0), kAnswer);
  EXPECT_EQ(rig.talk(kState2).at(0), kAnswer);
  EXPECT_EQ(rig.talk(kAsk).at(0), kAnswer);  // as it would have been without
  EXPECT_EQ(rig.effects(1), 2U);
  rig.clear();
  EXPECT_EQ(rig.talk(kState2).at(0), kState2Answer);
}

TEST(LinkFaults, ReorderSwapsNeighbours) {
  Rig rig(bus_config({1}));
  rig.set(fault(K::kReorder, {1}));
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

// --- what stands in the frame
// -----------------------------------------------------------------------------------

TEST(LinkFaults, WrongLength) {
  Rig rig(bus_config({1}));
  rig.set(fault(K::kWrongDlc, {1}, {4}));
  EXPECT_EQ(rig.talk(kState2).at(0), frame("141#9C190000"));
  rig.set(fault(K::kWrongDlc, {1}, {0}));
  EXPECT_EQ(rig.talk(kState2).at(0), frame("141#"));
  EXPECT_EQ(rig.effects(0), 2U);
}

TEST(LinkFaults, WrongIdentifierIsModulo2048AndTellsWhoseItIs) {
  Rig rig(bus_config({1, 2}));
  rig.set(fault(K::kWrongId, {1}, {1}));
  Frame expected = kState2Answer;
  expected.id = 0x142;
  EXPECT_EQ(rig.talk(kState2).at(0), expected);
  EXPECT_EQ(rig.seen[0].said_by, 1);
  rig.clear();
  rig.set(fault(K::kWrongId, {1}, {-0x142}));
  EXPECT_EQ(rig.talk(kState2).at(0).id, 0x7FFU);
  rig.clear();
  EXPECT_EQ(rig.talk(kState2).at(0), kState2Answer);
  EXPECT_EQ(rig.seen.back().said_by, 0);
}

TEST(LinkFaults, AcknowledgementsKeepTheirTags) {
  Rig rig(bus_config({1}));
  rig.set(fault(K::kDuplicate, {1}, {1}));
  rig.set(fault(K::kReorder, {1}));
  rig.set(fault(K::kWrongId, {1}, {5}));
  std::vector<std::uint64_t> tags;
  for (const char* text :
       {"141#9100000000000000", "141#9C00000000000000", "141#9100000000010000"}) {
    rig.talk(frame(text));
  }
  for (const TimedFrame& one : rig.seen) tags.push_back(one.after_rom_write);
  // The original of the second was held back behind its own copy.
  EXPECT_EQ(tags, (std::vector<std::uint64_t>{1, 1, 0, 0, 2, 2}));
}

// --- a second drive
// -----------------------------------------------------------------------------------------------

std::uint16_t encoder(const Frame& reply) {
  const auto decoded = protocol::decode_reply(reply, protocol::kLegacyFormat);
  const auto* content = std::get_if<protocol::ReplyFrame>(&decoded);
  const auto* read = content ? std::get_if<protocol::Encoder>(&content->reply) : nullptr;
  return read ? read->encoder_counts : std::uint16_t{0xFFFF};
}

TEST(LinkFaults, ASecondDriveTurnsAMotorOfItsOwn) {
  const Frame ask = frame("141#9000000000000000");
  Rig rig(bus_config({1}));
  rig.wait(10ms);
  rig.set(fault(K::kDuplicateId, {1}, {90}));
  auto replies = rig.talk(ask, 10ms);
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_EQ(replies[0].id, 0x141U);
  EXPECT_EQ(replies[1].id, 0x141U);
  EXPECT_NEAR(encoder(replies[0]), 16384 * 45 / 360, 1);  // a count covers [n, n + 1)
  EXPECT_NEAR(encoder(replies[1]), 16384 * 135 / 360, 1);
  EXPECT_EQ(rig.talk(frame("141#A2000000A0860100"), 500ms).size(), 2U);  // 1000 dps
  replies = rig.talk(ask);
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_GT(std::abs(encoder(replies[1]) - 6144), 100) << "it turns too";
  EXPECT_EQ(rig.effects(), 3U);
  EXPECT_EQ(rig.bus.stats().extra_frames, 3U);
  rig.clear();
  EXPECT_EQ(rig.talk(ask).size(), 1U);
  expect_balanced(rig.bus, rig.seen, "second drive");
}

TEST(LinkFaults, ASecondDrivesReplyTakesTheWireToo) {
  Rig rig(bus_config({1}, kBitrate));
  rig.set(fault(K::kDuplicateId, {1}, {0}));
  EXPECT_EQ(rig.talk(kAsk, 2ms), (std::vector<Frame>{kAnswer, kAnswer}));
  EXPECT_EQ(rig.seen[0].at, 338us);
  EXPECT_EQ(rig.seen[1].at, 341us + 118us);
  // Its own answers are all that is left when the drive is deaf.
  rig.set(fault(K::kDrop, {1}, {kQueries}));
  EXPECT_EQ(rig.talk(kAsk, 2ms).size(), 1U);
}

// --- silence and noise
// --------------------------------------------------------------------------------------------

TEST(LinkFaults, SilentDrivesObey) {
  Rig rig(bus_config({1}));
  rig.set(fault(K::kSilent, {1}));
  EXPECT_TRUE(rig.talk(kTorque, 10ms).empty());
  EXPECT_GT(rig.bus.truth(1).i_q_ref, 1);
  EXPECT_EQ(rig.effects(), 1U);
  EXPECT_EQ(rig.bus.stats().replies_lost, 1U);
  rig.clear();
  EXPECT_EQ(rig.talk(kState2).size(), 1U);
}

TEST(LinkFaults, BabbleComesEveryPeriod) {
  Rig rig(bus_config({1}));
  rig.wait(1ms);
  rig.set(fault(K::kBabbling, {1}, {1000, 0x7FF}));
  const auto frames = rig.wait(100ms);
  ASSERT_EQ(frames.size(), 101U);  // at 1, 2, … 101 ms
  for (std::size_t n = 0; n < frames.size(); ++n) {
    EXPECT_EQ(rig.seen[n].at, 1ms * (1 + n));
    EXPECT_EQ(frames[n], frame("7FF#0000000000000000"));
    EXPECT_EQ(rig.seen[n].said_by, 1);
  }
  EXPECT_EQ(rig.effects(), 101U);
  rig.clear();
  EXPECT_TRUE(rig.wait(100ms).empty());
}

TEST(LinkFaults, BabbleOfTheLowestIdentifierStarvesTheBus) {
  Rig rig(bus_config({1, 2}, kBitrate));
  rig.set(fault(K::kBabbling, {1}, {100, 0}));
  rig.wait(1us);
  rig.bus.receive({rig.bus.time(), frame("142#9A00000000000000")});
  const auto frames = rig.wait(1s);
  EXPECT_EQ(rig.bus.stats().queries, 0U);
  EXPECT_LE(rig.bus.stats().replies_waiting, 2U);
  // Nothing but it on the wire, to the last frame.
  EXPECT_NEAR(std::chrono::duration<double>(rig.bus.stats().wire_busy).count(), 1, 200e-6);
  EXPECT_EQ(rig.bus.stats().extra_frames, frames.size() + rig.bus.stats().replies_waiting);
  rig.clear();
  rig.wait(10ms);
  EXPECT_EQ(rig.bus.stats().queries, 1U);
  EXPECT_EQ(rig.seen.back().frame.id, 0x142U);
}

TEST(LinkFaults, AFullQueueKeepsSixteenInOrder) {
  for (const std::int64_t bitrate : {std::int64_t{0}, kBitrate}) {
    Rig rig(bus_config({1}, bitrate));
    rig.set(fault(K::kQueueFull, {1}));
    std::vector<std::uint8_t> asked;
    for (int n = 0; n < 20; ++n) {
      Frame query = kState2;
      query.data[0] = n % 3 == 0 ? 0x9A : n % 3 == 1 ? 0x9C : 0x92;
      if (n < 16) asked.push_back(query.data[0]);
      EXPECT_TRUE(rig.talk(query, 1ms).empty());
    }
    EXPECT_EQ(rig.dropped(Drop::kDriveBusy), 4U);
    EXPECT_EQ(rig.effects(), 20U);  // 16 held, 4 ignored
    rig.clear();
    std::vector<std::uint8_t> answered;
    for (const Frame& reply : rig.wait(5ms)) answered.push_back(reply.data[0]);
    EXPECT_EQ(answered, asked);
    EXPECT_EQ(rig.talk(kState2, 1ms).size(), 1U);
    expect_balanced(rig.bus, rig.seen, "full queue");
  }
}

TEST(LinkFaults, AFrameThatHasBegunGoesToItsEnd) {
  Rig rig(bus_config({1}, kBitrate));
  EXPECT_TRUE(rig.talk(kAsk, 221us).empty());  // its reply begins at 220 µs
  rig.set(fault(K::kQueueFull, {1}));
  EXPECT_EQ(rig.wait(1ms).size(), 1U);
  EXPECT_EQ(rig.seen[0].at, 338us);
  EXPECT_EQ(rig.effects(), 0U);
}

// --- error frames and bus-off
// ------------------------------------------------------------------------------------

// linux/can/error.h
constexpr std::uint32_t kProtocolAndBusError = 0x08 | 0x80;
constexpr std::uint32_t kControllerState = 0x04;
constexpr std::uint32_t kHostIsBusOff = 0x40;

bool is_error(const Frame& frame) {
  return frame.kind == FrameKind::kError && frame.dlc == 8 &&
         (frame.id & kProtocolAndBusError) == kProtocolAndBusError;
}

TEST(LinkFaults, ADestroyedFrameIsSentAgain) {
  Rig rig(bus_config({1}, kBitrate));
  rig.set(fault(K::kErrorFrames, {}));
  ASSERT_EQ(rig.talk(kAsk, 125us).size(), 1U);
  EXPECT_TRUE(is_error(rig.seen[0].frame));
  EXPECT_EQ(rig.seen[0].at, 120us);
  EXPECT_EQ(rig.seen[0].frame.data[2], 0x80 | 0x10);  // on transmission: no recessive bit
  EXPECT_EQ(rig.seen[0].frame.data[6], 8);            // its counter
  EXPECT_EQ(rig.bus.stats().queries, 0U);
  rig.clear();
  EXPECT_EQ(rig.wait(1ms), std::vector<Frame>{kAnswer});
  EXPECT_EQ(rig.seen[1].at, 120us + 11us + 120us + 100us + 118us);
  EXPECT_EQ(rig.bus.stats().wire_busy, 131us + 123us + 121us);
  EXPECT_EQ(rig.effects(), 1U);
}

TEST(LinkFaults, WithErrorFramesNowAndThenEverythingGetsThrough) {
  for (const std::int64_t bitrate : {std::int64_t{0}, kBitrate}) {
    Rig rig(bus_config({1}, bitrate));
    rig.set(fault(K::kErrorFrames, {}, {}, 0.05));
    for (int n = 0; n < 1000; ++n) rig.talk(kState2, 2ms);
    const BusStats stats = rig.bus.stats();
    EXPECT_EQ(stats.replies, 1000U);
    EXPECT_EQ(stats.error_frames, rig.effects());
    // Failures before 2000 successes: mean 2000·p/(1−p), variance that over 1−p.
    const double mean = 2000 * 0.05 / 0.95;
    EXPECT_NEAR(static_cast<double>(stats.error_frames), mean, 5 * std::sqrt(mean / 0.95));
    expect_balanced(rig.bus, rig.seen, "error frames");
  }
}

TEST(LinkFaults, WhenNothingGetsThroughTheHostGivesUpAfter32Attempts) {
  for (const std::int64_t bitrate : {std::int64_t{0}, kBitrate}) {
    Rig rig(bus_config({1}, bitrate));
    rig.set(fault(K::kErrorFrames, {}));
    const auto frames = rig.talk(kAsk, 10ms);
    ASSERT_EQ(frames.size(), 32U);  // 256 / 8
    for (int n = 1; n <= 32; ++n) {
      const Frame& error = frames[static_cast<std::size_t>(n - 1)];
      EXPECT_TRUE(is_error(error));
      EXPECT_EQ(error.data[1], n == 12 ? 0x08 : n == 16 ? 0x20 : 0);  // warning 96, passive 128
      EXPECT_EQ((error.id & kControllerState) != 0, n == 12 || n == 16);
      EXPECT_EQ((error.id & kHostIsBusOff) != 0, n == 32);
      const int passive = std::max(n - 16, 0);
      EXPECT_EQ(rig.seen[static_cast<std::size_t>(n - 1)].at,
                bitrate == 0 ? 0us : 131us * (n - 1) + 120us + 8us * passive);
    }
    EXPECT_EQ(rig.dropped(Drop::kFault), 1U);
    EXPECT_EQ(rig.bus.stats().queries, 0U);
    rig.clear();
    EXPECT_EQ(rig.talk(kAsk, 1ms).size(), 1U);
    expect_balanced(rig.bus, rig.seen, "nothing gets through");
  }
}

TEST(LinkFaults, BusOffAfter32SpoiledRepliesAndBackAfterTheRecovery) {
  Rig rig(bus_config({1, 2}, kBitrate));
  rig.set(fault(K::kBusOff, {1}, {100}));
  const auto frames = rig.talk(kAsk, 50ms);
  ASSERT_EQ(frames.size(), 32U);
  for (int n = 1; n <= 32; ++n) {
    const TimedFrame& error = rig.seen[static_cast<std::size_t>(n - 1)];
    EXPECT_TRUE(is_error(error.frame));
    EXPECT_EQ(error.frame.id & kControllerState, 0U) << "a drive's state is not on the wire";
    EXPECT_EQ(error.frame.data[7], n) << "the host's own receive error counter";
    // The 17th attempt is the first of an error-passive sender: 8 bits more each.
    EXPECT_EQ(error.at, 220us + 129us * (n - 1) + 118us + 8us * std::max(n - 16, 0));
  }
  EXPECT_EQ(rig.effects(), 32U);
  EXPECT_EQ(rig.bus.stats().replies_lost, 1U);
  rig.clear();  // it has to recover all the same
  EXPECT_EQ(rig.talk(frame("142#9A00000000000000"), 1ms).size(), 1U) << "the other drive";
  const SimTime back = 220us + 129us * 31 + 118us + 8us * 16 + 100ms + 1408us;  // 128 × 11 bits
  // Two queries, the last bit of one before and of the other behind that instant.
  rig.wait(back - 123us - rig.bus.time());
  EXPECT_TRUE(rig.talk(kAsk, 122us).empty());
  EXPECT_EQ(rig.dropped(Drop::kFault), 1U);
  rig.wait(1us);
  EXPECT_EQ(rig.talk(kAsk, 1ms), std::vector<Frame>{kAnswer});
  expect_balanced(rig.bus, rig.seen, "bus off");
}

TEST(LinkFaults, BusOffBeginsAnewWhileItLasts) {
  for (const std::int64_t bitrate : {std::int64_t{0}, kBitrate}) {
    Rig rig(bus_config({1}, bitrate));
    rig.set(fault(K::kBusOff, {1}, {10}));
    EXPECT_EQ(rig.talk(kAsk, 7ms).size(), 32U);
    EXPECT_EQ(rig.talk(kAsk, 13ms).size(), 0U) << "deaf";
    EXPECT_EQ(rig.talk(kAsk, 20ms).size(), 32U);
    EXPECT_EQ(rig.dropped(Drop::kFault), 1U);
    EXPECT_EQ(rig.bus.stats().replies, 0U);
    EXPECT_EQ(rig.bus.stats().replies_lost, 2U);
  }
}

// --- all kinds
// ----------------------------------------------------------------------------------------------------

TEST(LinkFaults, WhatNeverFiresChangesNothing) {
  Rig plain(bus_config({1, 2}, kBitrate)), armed(bus_config({1, 2}, kBitrate));
  for (const K kind : {K::kDrop, K::kDelay, K::kDuplicate, K::kCorrupt, K::kStale, K::kReorder,
                       K::kWrongDlc, K::kWrongId}) {
    armed.set(fault(kind, {1, 2}, {5, 2}, 0));
  }
  armed.set(fault(K::kErrorFrames, {}, {}, 0));
  for (Rig* rig : {&plain, &armed}) {
    for (int n = 0; n < 100; ++n) rig->talk(n % 2 == 0 ? kAsk : kTorque, 400us);
    rig->wait(5ms);
  }
  EXPECT_EQ(armed.seen, plain.seen);
  EXPECT_EQ(armed.bus.stats(), plain.bus.stats());
  for (const FaultReport& report : armed.bus.faults()) EXPECT_EQ(report.evidence.effects, 0U);
}

constexpr std::array kKinds{K::kDrop,        K::kDelay,    K::kDuplicate, K::kCorrupt,
                            K::kStale,       K::kReorder,  K::kWrongDlc,  K::kWrongId,
                            K::kDuplicateId, K::kSilent,   K::kBabbling,  K::kErrorFrames,
                            K::kBusOff,      K::kQueueFull};

/// One of the group, at random.
Fault random_fault(std::mt19937& random, int drives) {
  const auto below = [&](unsigned n) { return static_cast<int>(random() % n); };
  Fault made = fault(kKinds[static_cast<std::size_t>(below(kKinds.size()))], {});
  made.probability = 0.1 * (1 + below(10));
  made.duration = 1ms * (1 + below(60));
  if (below(3) == 0) {
    made.every = *made.duration + 5ms;
    made.times = 3;
  }
  const std::array<double, kKinds.size()> first{0, 3, 2, 5, 0, 0, 4, 700, 30, 0, 150, 0, 5, 0};
  made.values[0] = first[static_cast<std::size_t>(made.kind)];
  if (made.kind == K::kDrop) made.values[0] = below(3);
  if (made.kind == K::kCorrupt) made.values[1] = below(3);
  if (made.kind == K::kDelay) made.values[1] = 2;
  if (made.kind == K::kBabbling) made.values[1] = below(2048);
  if (made.kind != K::kErrorFrames) {
    const int one = 1 + below(static_cast<unsigned>(drives));
    for (int id = one; id <= std::min(one + below(3), drives); ++id) made.ids.push_back(id);
  }
  return made;
}

BusConfig random_bus(int drives, std::int64_t bitrate, std::uint32_t seed, int faults) {
  BusConfig config = bus_config({}, bitrate);
  config.seed = seed;
  std::mt19937 random(seed);
  for (int id = 1; id <= drives; ++id) {
    config.servos.push_back(test::servo_config(id));
    config.servos.back().rom.broadcast_mode = id <= 4 && random() % 2 == 0;
  }
  for (int n = 0; n < faults; ++n) {
    config.events.push_back(
        {SimTime(random() % 300'000'000), {kWholeBus, SetFault{random_fault(random, drives)}}});
  }
  for (int n = 0; n < 4; ++n) {
    config.events.push_back({SimTime(random() % 300'000'000), {kWholeBus, ClearFault{"all"}}});
    config.events.push_back({SimTime(random() % 300'000'000), {1, PowerCycle{20ms}}});
  }
  std::ranges::stable_sort(config.events, {}, &TimedDirective::at);
  return config;
}

std::vector<TimedFrame> random_traffic(int drives, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<TimedFrame> frames;
  for (SimTime at{0}; at < 350ms; at += SimTime(random() % 400'000)) {
    TimedFrame in{at, kState2};
    in.frame.id = random() % 8 == 0 ? 0x280U
                                    : 0x141U + static_cast<std::uint32_t>(random()) %
                                                   static_cast<unsigned>(drives);
    constexpr std::array<std::uint8_t, 6> kCommands{0x9A, 0x9C, 0xA1, 0x90, 0x91, 0x92};
    in.frame.data[0] = kCommands[random() % kCommands.size()];
    in.frame.data[4] = static_cast<std::uint8_t>(random() % 256);
    frames.push_back(in);
  }
  return frames;
}

struct Outcome {
  std::vector<TimedFrame> seen;
  BusStats stats;
  std::vector<std::uint64_t> effects;
};

/// Advances from frame to frame, at random instants in between as well when `slices`.
Outcome run(Bus bus, const std::vector<TimedFrame>& frames, std::mt19937* slices) {
  Outcome outcome;
  const auto advance = [&](SimTime until) {
    while (slices != nullptr && bus.time() < until && (*slices)() % 4 != 0) {
      bus.advance_to(std::min(until, bus.time() + SimTime((*slices)() % 100'000)));
      if ((*slices)() % 3 == 0) bus.take_replies(outcome.seen);
    }
    bus.advance_to(until);
  };
  for (const TimedFrame& in : frames) {
    advance(in.at);
    bus.receive(in);
  }
  advance(500ms);
  bus.take_replies(outcome.seen);
  outcome.stats = bus.stats();
  for (const FaultReport& report : bus.faults()) outcome.effects.push_back(report.evidence.effects);
  expect_balanced(bus, outcome.seen, "random faults");
  return outcome;
}

TEST(LinkFaults, SlicesDoNotMatter) {
  for (const std::int64_t bitrate : {std::int64_t{0}, std::int64_t{500'000}, kBitrate}) {
    for (const std::uint32_t seed : {1U, 2U}) {
      const Bus bus(random_bus(4, bitrate, seed, 30));
      const auto frames = random_traffic(4, seed);
      const Outcome plain = run(bus, frames, nullptr);
      EXPECT_GT(plain.stats.error_frames, 0U);
      EXPECT_GT(plain.stats.extra_frames, 0U);
      std::mt19937 slices(seed + 10);
      Outcome split = run(bus, frames, &slices);
      split.stats.queue_peak = plain.stats.queue_peak;  // depends on who runs ahead of time
      EXPECT_EQ(split.seen, plain.seen) << bitrate;
      EXPECT_EQ(split.stats, plain.stats);
      EXPECT_EQ(split.effects, plain.effects);
    }
  }
}

TEST(LinkFaults, TheBooksBalanceWhateverHappens) {
  for (const std::int64_t bitrate : {std::int64_t{0}, kBitrate}) {
    for (std::uint32_t seed = 1; seed <= 3; ++seed) {
      const Outcome outcome =
          run(Bus(random_bus(32, bitrate, seed, 200)), random_traffic(32, seed), nullptr);
      EXPECT_GT(outcome.stats.replies_lost, 0U);
      EXPECT_GT(outcome.stats.replies, 0U);
    }
  }
}

}  // namespace
}  // namespace lk::emulator
