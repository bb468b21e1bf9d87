// All link faults at once: results do not depend on slicing, and all frames are accounted for.

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "emulator/core/faults/fault_table.hpp"
#include "tests/emulator/core/faults/link_support.hpp"

namespace lk::emulator {
namespace link_soak_test {

// --- all kinds

TEST(LinkFaults, WhatNeverFiresChangesNothing) {
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
      split.stats.queue_peak = plain.stats.queue_peak;  // depends on how far the caller runs ahead
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

}  // namespace link_soak_test
}  // namespace lk::emulator
