// Equal configuration, seed and frame times give equal replies, byte for byte.

#include <gtest/gtest.h>

#include <random>
#include <span>

#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace determinism_test {

using namespace std::chrono_literals;

/// Drives of two PWM rates with noise, one of them in multi-drive mode.
BusConfig mixed_config(std::int64_t bitrate, std::uint64_t seed) {
  BusConfig config = test::bus_config({1, 2, 3, 9, 32}, bitrate);
  config.seed = seed;
  for (auto& servo : config.servos) {
    servo.profile.drive.current_sensor.noise = 0.05;
    servo.profile.drive.slow_sensor.v_noise = 0.02;
    servo.profile.drive.encoder.noise = 1e-4;
    servo.boot_angle_deg.reset();
  }
  config.servos[1].profile.drive.inverter.f_pwm = 24000;
  config.servos[3].profile.drive.inverter.f_pwm = 24000;
  config.servos[2].rom.broadcast_mode = true;
  config.servos[4].reply_time = 350us;
  return config;
}

/// Traffic in order of time: sparse, bursts, equal instants, invalid frames, and floods that
/// overflow the queue.
std::vector<TimedFrame> traffic(std::uint32_t seed, int count) {
  std::mt19937 random(seed);
  const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
  std::vector<TimedFrame> frames;
  SimTime at = 0ns;
  for (int k = 0; k < count; ++k) {
    const std::uint32_t pace = below(10);
    at += pace < 4 ? 0ns : pace < 8 ? SimTime(below(300'000)) : SimTime(below(3'000'000));
    TimedFrame in{at, {}};
    constexpr std::array<std::uint32_t, 8> kIds{0x141, 0x142, 0x143, 0x149,
                                                0x160, 0x280, 0x144, 0x7FF};
    in.frame.id = kIds[below(kIds.size())];
    for (auto& byte : std::span(in.frame.data).first(protocol::kCanBytes)) {
      byte = static_cast<std::uint8_t>(below(4) == 0 ? below(256) : 0);
    }
    if (below(20) != 0) {
      in.frame.data[0] = static_cast<std::uint8_t>(protocol::commands()[below(26)].opcode);
    }
    in.frame.dlc = below(50) == 0 ? static_cast<std::uint8_t>(below(8)) : 8;
    in.frame.extended = below(50) == 0;
    in.frame.kind = below(50) == 0 ? protocol::FrameKind::kRemote : protocol::FrameKind::kData;
    frames.push_back(in);
    if (below(300) == 0) {
      frames.insert(frames.end(), 1500, in);
    }
  }
  return frames;
}

struct Outcome {
  std::vector<TimedFrame> replies;
  BusStats stats;
};

constexpr SimTime kSettle = 300ms;  // empties the queues at the end

/// Advances only to the frames.
Outcome run_plainly(Bus bus, const std::vector<TimedFrame>& frames) {
  Outcome run;
  for (const TimedFrame& in : frames) {
    bus.advance_to(in.at);
    bus.receive(in);
  }
  bus.advance_to(frames.back().at + kSettle);
  bus.take_replies(run.replies);
  run.stats = bus.stats();
  return run;
}

/// Advances at random instants in between, sometimes not at all or to the next due time, and takes
/// the replies at random. With `copying` it sometimes continues with a copy of the bus.
Outcome run_split(Bus bus, const std::vector<TimedFrame>& frames, std::uint32_t seed,
                  bool copying) {
  std::mt19937 random(seed);
  Outcome run;
  for (const TimedFrame& in : frames) {
    while (random() % 3 == 0 && bus.time() < in.at) {
      const auto left = static_cast<std::uint32_t>((in.at - bus.time()).count());
      bus.advance_to(bus.time() + SimTime(random() % (left + 1)));
    }
    if (const auto due = bus.next_due(); random() % 4 == 0 && due && *due <= in.at) {
      bus.advance_to(*due);
    }
    if (random() % 5 == 0) {
      bus.take_replies(run.replies);
    }
    if (copying && random() % 50 == 0) {
      Bus copy = bus;
      bus.advance_to(in.at + 5ms);  // the original continues separately
      bus = copy;
    }
    bus.receive(in);
  }
  for (const SimTime end = frames.back().at + kSettle; bus.time() < end;) {
    bus.advance_to(std::min(end, bus.time() + SimTime(random() % 1'000'000)));
  }
  bus.take_replies(run.replies);
  run.stats = bus.stats();
  return run;
}

class Determinism : public ::testing::TestWithParam<std::int64_t> {};

TEST_P(Determinism, SplitsDoNotMatter) {
  const Bus bus(mixed_config(GetParam(), 1));
  const auto frames = traffic(11, 1500);
  const Outcome plain = run_plainly(bus, frames);
  EXPECT_GT(plain.replies.size(), 300U);
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    const Outcome split = run_split(bus, frames, seed, seed % 2 == 0);
    ASSERT_EQ(split.replies, plain.replies);
    // The peak of the queue depends on how far the caller runs ahead with receive().
    BusStats stats = split.stats;
    stats.queue_peak = plain.stats.queue_peak;
    EXPECT_EQ(stats, plain.stats);
  }
}

TEST_P(Determinism, SameBytesAgain) {
  const auto frames = traffic(12, 500);
  const Outcome first = run_plainly(Bus(mixed_config(GetParam(), 7)), frames);
  const Outcome second = run_plainly(Bus(mixed_config(GetParam(), 7)), frames);
  EXPECT_EQ(first.replies, second.replies);
  EXPECT_EQ(first.stats, second.stats);
}

TEST_P(Determinism, AnotherSeedIsAnotherBus) {
  const auto frames = traffic(13, 200);
  const Outcome first = run_plainly(Bus(mixed_config(GetParam(), 7)), frames);
  const Outcome second = run_plainly(Bus(mixed_config(GetParam(), 8)), frames);
  EXPECT_NE(first.replies, second.replies);
}

TEST_P(Determinism, RepliesAreInOrderOfTime) {
  const Outcome run = run_plainly(Bus(mixed_config(GetParam(), 7)), traffic(14, 1000));
  for (std::size_t k = 1; k < run.replies.size(); ++k) {
    ASSERT_LE(run.replies[k - 1].at, run.replies[k].at);
  }
}

INSTANTIATE_TEST_SUITE_P(Bitrates, Determinism, ::testing::Values(0, 250'000, 1'000'000));

// A drive does not depend on other drives: alone on a bus it gives the same bytes.
TEST(Company, DoesNotMatter) {
  BusConfig together = mixed_config(0, 5);
  BusConfig alone = together;
  alone.servos = {together.servos[0]};
  const auto frames = traffic(15, 500);
  std::vector<TimedFrame> expected;
  for (const auto& reply : run_plainly(Bus(together), frames).replies) {
    if (reply.frame.id == 0x141) {
      expected.push_back(reply);
    }
  }
  EXPECT_EQ(run_plainly(Bus(alone), frames).replies, expected);
}

}  // namespace determinism_test
}  // namespace lk::emulator
