// Silence, noise, error frames, bus-off, and random link faults, as a host observes them.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>
#include <string>

#include "emulator/core/faults/fault_table.hpp"
#include "tests/emulator/core/faults/link_support.hpp"

namespace lk::emulator {
namespace link_errors_test {

// --- silence and noise

TEST(LinkFaults, SilentDriveExecutesCommands) {
  Rig rig(bus_config({1}));
  rig.set(fault("silent", {1}));
  EXPECT_TRUE(rig.talk(kTorque, 10ms).empty());
  EXPECT_GT(rig.bus.truth(1).i_q_ref, 1);
  EXPECT_EQ(rig.effects(), 1U);
  EXPECT_EQ(rig.bus.stats().replies_lost, 1U);
  rig.clear();
  EXPECT_EQ(rig.talk(kState2).size(), 1U);
}

TEST(LinkFaults, BabblingRepeatsEveryPeriod) {
  Rig rig(bus_config({1}));
  rig.wait(1ms);
  rig.set(fault("babbling", {1}, {1000, 0x7FF}));
  const auto frames = rig.wait(100ms);
  ASSERT_EQ(frames.size(), 101U);  // at 1, 2, … 101 ms
  for (std::size_t n = 0; n < frames.size(); ++n) {
    EXPECT_EQ(rig.seen[n].at, 1ms * (1 + n));
    EXPECT_EQ(frames[n], frame("7FF#0000000000000000"));
    EXPECT_EQ(rig.seen[n].drive_id, 1);
  }
  EXPECT_EQ(rig.effects(), 101U);
  rig.clear();
  EXPECT_TRUE(rig.wait(100ms).empty());
}

TEST(LinkFaults, BabblingWithTheLowestIdentifierBlocksTheBus) {
  Rig rig(bus_config({1, 2}, kBitrate));
  rig.set(fault("babbling", {1}, {100, 0}));
  rig.wait(1us);
  rig.bus.receive({rig.bus.time(), frame("142#9A00000000000000")});
  const auto frames = rig.wait(1s);
  EXPECT_EQ(rig.bus.stats().queries, 0U);
  EXPECT_LE(rig.bus.stats().replies_waiting, 2U);
  // The wire carries only these frames, until the last one.
  EXPECT_NEAR(std::chrono::duration<double>(rig.bus.stats().wire_busy).count(), 1, 200e-6);
  EXPECT_EQ(rig.bus.stats().extra_frames, frames.size() + rig.bus.stats().replies_waiting);
  rig.clear();
  rig.wait(10ms);
  EXPECT_EQ(rig.bus.stats().queries, 1U);
  EXPECT_EQ(rig.seen.back().frame.id, 0x142U);
}

TEST(LinkFaults, BabblingPausesWithoutPower) {
  Rig rig(test::powered_bus({1}));
  rig.set(fault("babbling", {1}, {1000, 0x7FF}));
  rig.bus.apply({1, PowerOff{}});
  rig.wait(1s);
  const auto before = rig.effects();
  EXPECT_TRUE(rig.wait(100ms).empty());
  EXPECT_EQ(rig.effects(), before);
  rig.bus.apply({1, PowerOn{}});
  rig.wait(100ms);
  EXPECT_EQ(rig.wait(10ms).size(), 10U);
  expect_balanced(rig.bus, rig.seen, "babbling without power");
}

TEST(LinkFaults, BabblingIsDroppedAtAFullQueue) {
  Rig rig(bus_config({1}));
  rig.set(fault("queue_full", {1}));
  for (int n = 0; n < 16; ++n) EXPECT_TRUE(rig.talk(kState2).empty());
  rig.set(fault("babbling", {1}, {1000, 0x7FF}));
  EXPECT_TRUE(rig.wait(20ms).empty());
  EXPECT_EQ(rig.effects(1), 0U);
  EXPECT_EQ(rig.bus.stats().extra_frames, 0U);
  rig.clear();
  EXPECT_EQ(rig.wait(20ms), std::vector<Frame>(16, kState2Answer));
  expect_balanced(rig.bus, rig.seen, "babbling and a full queue");
}

TEST(LinkFaults, FullQueueKeepsSixteenInOrder) {
  for (const std::int64_t bitrate : {std::int64_t{0}, kBitrate}) {
    Rig rig(bus_config({1}, bitrate));
    rig.set(fault("queue_full", {1}));
    std::vector<std::uint8_t> sent;
    for (int n = 0; n < 20; ++n) {
      const Frame query = mixed_query(n);
      if (n < 16) sent.push_back(query.data[0]);
      EXPECT_TRUE(rig.talk(query, 1ms).empty());
    }
    EXPECT_EQ(rig.dropped(Drop::kDriveBusy), 4U);
    EXPECT_EQ(rig.effects(), 20U);  // 16 held, 4 ignored
    rig.clear();
    std::vector<std::uint8_t> answered;
    for (const Frame& reply : rig.wait(5ms)) answered.push_back(reply.data[0]);
    EXPECT_EQ(answered, sent);
    EXPECT_EQ(rig.talk(kState2, 1ms).size(), 1U);
    expect_balanced(rig.bus, rig.seen, "full queue");
  }
}

// --- error frames and bus-off

// linux/can/error.h
constexpr std::uint32_t kProtocolAndBusError = 0x08 | 0x80;
constexpr std::uint32_t kControllerState = 0x04;
constexpr std::uint32_t kHostIsBusOff = 0x40;

bool is_error(const Frame& frame) {
  return frame.kind == FrameKind::kError && frame.dlc == 8 &&
         (frame.id & kProtocolAndBusError) == kProtocolAndBusError;
}

TEST(LinkFaults, DestroyedFrameIsRepeated) {
  Rig rig(bus_config({1}, kBitrate));
  rig.set(fault("error_frames", {}));
  ASSERT_EQ(rig.talk(kAsk, 125us).size(), 1U);
  EXPECT_TRUE(is_error(rig.seen[0].frame));
  EXPECT_EQ(rig.seen[0].at, 120us);
  EXPECT_EQ(rig.seen[0].frame.data[2], 0x80 | 0x10);  // during transmission: no recessive bit
  EXPECT_EQ(rig.seen[0].frame.data[6], 8);            // its error counter
  EXPECT_EQ(rig.bus.stats().queries, 0U);
  rig.clear();
  EXPECT_EQ(rig.wait(1ms), std::vector<Frame>{kAnswer});
  EXPECT_EQ(rig.seen[1].at, 120us + 11us + 120us + 100us + 118us);
  EXPECT_EQ(rig.bus.stats().wire_busy, 131us + 123us + 121us);
  EXPECT_EQ(rig.effects(), 1U);
}

TEST(LinkFaults, RareErrorFramesLoseNothing) {
  for (const std::int64_t bitrate : {std::int64_t{0}, kBitrate}) {
    Rig rig(bus_config({1}, bitrate));
    rig.set(fault("error_frames", {}, {}, 0.05));
    for (int n = 0; n < 1000; ++n) rig.talk(kState2, 2ms);
    const BusStats stats = rig.bus.stats();
    EXPECT_EQ(stats.replies, 1000U);
    EXPECT_EQ(stats.error_frames, rig.effects());
    // Failures before 2000 successes: mean 2000·p/(1−p), variance mean/(1−p).
    const double mean = 2000 * 0.05 / 0.95;
    EXPECT_NEAR(static_cast<double>(stats.error_frames), mean, 5 * std::sqrt(mean / 0.95));
    expect_balanced(rig.bus, rig.seen, "error frames");
  }
}

TEST(LinkFaults, HostIsBusOffAfter32Attempts) {
  for (const std::int64_t bitrate : {std::int64_t{0}, kBitrate}) {
    Rig rig(bus_config({1}, bitrate));
    rig.set(fault("error_frames", {}));
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

TEST(LinkFaults, DriveIsBusOffAfter32AttemptsUntilItsRecovery) {
  Rig rig(bus_config({1, 2}, kBitrate));
  rig.set(fault("bus_off", {1}, {100}));
  const auto frames = rig.talk(kAsk, 50ms);
  ASSERT_EQ(frames.size(), 32U);
  for (int n = 1; n <= 32; ++n) {
    const TimedFrame& error = rig.seen[static_cast<std::size_t>(n - 1)];
    EXPECT_TRUE(is_error(error.frame));
    EXPECT_EQ(error.frame.id & kControllerState, 0U) << "a drive's state is not on the wire";
    EXPECT_EQ(error.frame.data[7], n) << "the host's own receive error counter";
    // The 17th attempt is the first as error-passive: 8 more bits for each from then on.
    EXPECT_EQ(error.at, 220us + 129us * (n - 1) + 118us + 8us * std::max(n - 16, 0));
  }
  EXPECT_EQ(rig.effects(), 32U);
  EXPECT_EQ(rig.bus.stats().replies_lost, 1U);
  rig.clear();  // recovery is still needed
  EXPECT_EQ(rig.talk("142#9A00000000000000", 1ms).size(), 1U) << "the other drive";
  const SimTime back = 220us + 129us * 31 + 118us + 8us * 16 + 100ms + 1408us;  // 128 × 11 bits
  // Two queries, with the last bit of one before and of the other after that instant.
  rig.wait(back - 123us - rig.bus.time());
  EXPECT_TRUE(rig.talk(kAsk, 122us).empty());
  EXPECT_EQ(rig.dropped(Drop::kFault), 1U);
  rig.wait(1us);
  EXPECT_EQ(rig.talk(kAsk, 1ms), std::vector<Frame>{kAnswer});
  expect_balanced(rig.bus, rig.seen, "bus off");
}

TEST(LinkFaults, BusOffRepeatsAfterEachRecovery) {
  for (const std::int64_t bitrate : {std::int64_t{0}, kBitrate}) {
    Rig rig(bus_config({1, 2}, bitrate));
    rig.set(fault("bus_off", {1}, {10}));
    EXPECT_EQ(rig.talk(kAsk, 7ms).size(), 32U);
    EXPECT_EQ(rig.talk(kAsk, 13ms).size(), 0U) << "bus-off";
    EXPECT_EQ(rig.talk(kAsk, 20ms).size(), 32U);
    EXPECT_EQ(rig.dropped(Drop::kFault), 1U);
    EXPECT_EQ(rig.bus.stats().replies, 0U);
    EXPECT_EQ(rig.bus.stats().replies_lost, 2U);
  }
}

TEST(LinkFaults, PowerCycleEndsBusOff) {
  Rig rig(test::powered_bus({1, 2}, kBitrate));
  rig.set(fault("bus_off", {1}, {10'000}));
  EXPECT_EQ(rig.talk(kAsk, 50ms).size(), 32U);
  rig.clear();
  EXPECT_TRUE(rig.talk(kAsk, 10ms).empty()) << "it has to recover";
  rig.bus.apply({1, PowerCycle{}});
  rig.wait(2s);
  EXPECT_EQ(rig.talk(kState2, 1ms).size(), 1U) << "its controller has restarted";
  EXPECT_FALSE(rig.bus.next_due()) << "no recovery is pending";
  expect_balanced(rig.bus, rig.seen, "bus-off and power off");
}

// --- all kinds at once

TEST(LinkFaults, DoNothingWithAProbabilityOfZero) {
  Rig plain(bus_config({1, 2}, kBitrate));
  Rig armed(bus_config({1, 2}, kBitrate));
  for (const char* kind :
       {"drop", "delay", "duplicate", "corrupt", "stale", "reorder", "wrong_dlc", "wrong_id"}) {
    armed.set(fault(kind, {1, 2}, {}, 0));
  }
  armed.set(fault("error_frames", {}, {}, 0));
  for (Rig* rig : {&plain, &armed}) {
    for (int n = 0; n < 100; ++n) rig->talk(n % 2 == 0 ? kAsk : kTorque, 400us);
    rig->wait(5ms);
  }
  EXPECT_EQ(armed.seen, plain.seen);
  EXPECT_EQ(armed.bus.stats(), plain.bus.stats());
  for (const FaultReport& report : armed.bus.faults()) EXPECT_EQ(report.evidence.effects, 0U);
}

constexpr std::array<std::string_view, 14> kKinds{
    "drop",     "delay",        "duplicate", "corrupt",  "stale",        "reorder", "wrong_dlc",
    "wrong_id", "duplicate_id", "silent",    "babbling", "error_frames", "bus_off", "queue_full"};

/// Returns a random fault of the group.
Fault random_fault(std::mt19937& random, int drives) {
  const auto below = [&](unsigned n) { return static_cast<int>(random() % n); };
  const auto kind = static_cast<std::size_t>(below(kKinds.size()));
  Fault made = fault(kKinds[kind], {});
  made.probability = 0.1 * (1 + below(10));
  made.duration = 1ms * (1 + below(60));
  if (below(3) == 0) {
    made.every = *made.duration + 5ms;
    made.times = 3;
  }
  const std::array<double, kKinds.size()> first{0, 3, 2, 5, 0, 0, 4, 700, 30, 0, 150, 0, 5, 0};
  made.values[0] = first[kind];
  if (made.row->word == "drop") made.values[0] = static_cast<FaultChoice>(below(3));
  if (made.row->word == "corrupt") made.values[1] = static_cast<FaultChoice>(below(3));
  if (made.row->word == "delay") made.values[1] = 2;
  if (made.row->word == "babbling") made.values[1] = below(2048);
  if (made.row->word != "error_frames") {
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
    const std::string_view kind = kKinds[random() % kKinds.size()];
    config.events.push_back(
        {SimTime(random() % 300'000'000), {kWholeBus, ClearFault{std::string(kind)}}});
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

/// Advances from frame to frame; with `slices` also at random instants in between.
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

TEST(LinkFaults, DoNotDependOnSlices) {
  for (const std::int64_t bitrate : {std::int64_t{0}, std::int64_t{500'000}, kBitrate}) {
    for (const std::uint32_t seed : {1U, 2U}) {
      const Bus bus(random_bus(4, bitrate, seed, 30));
      const auto frames = random_traffic(4, seed);
      const Outcome plain = run(bus, frames, nullptr);
      EXPECT_GT(plain.stats.error_frames, 0U);
      EXPECT_GT(plain.stats.extra_frames, 0U);
      std::mt19937 slices(seed + 10);
      Outcome split = run(bus, frames, &slices);
      split.stats.queue_peak = plain.stats.queue_peak;  // depends on how far the caller runs ahead
      EXPECT_EQ(split.seen, plain.seen) << bitrate;
      EXPECT_EQ(split.stats, plain.stats);
      EXPECT_EQ(split.effects, plain.effects);
    }
  }
}

TEST(LinkFaults, CountersBalanceUnderRandomFaults) {
  for (const std::int64_t bitrate : {std::int64_t{0}, kBitrate}) {
    for (std::uint32_t seed = 1; seed <= 3; ++seed) {
      const Outcome outcome =
          run(Bus(random_bus(32, bitrate, seed, 200)), random_traffic(32, seed), nullptr);
      EXPECT_GT(outcome.stats.replies_lost, 0U);
      EXPECT_GT(outcome.stats.replies, 0U);
    }
  }
}

}  // namespace link_errors_test
}  // namespace lk::emulator
