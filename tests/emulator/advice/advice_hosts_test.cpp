// Advice that several hosts command one drive, and none for a single host.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "tests/emulator/advice/advice_support.hpp"

namespace lk::emulator {
namespace advice_hosts_test {

using protocol::Position2;

std::int32_t cdeg(double deg) { return static_cast<std::int32_t>(std::lround(100 * deg)); }
protocol::Frame speed(double dps) { return query(protocol::Speed{dps, 0}); }
protocol::Frame target(double deg) { return query(Position2{100, cdeg(deg)}); }

/// Frames of two programs on one bus, each with its own clock.
class Merged {
 public:
  /// Adds `times` frames from `phase` on.
  void add(SimTime phase, SimTime period, int times, const protocol::Frame& frame) {
    for (int n = 0; n < times; ++n) frames_.push_back({phase + n * period, frame});
  }
  bool are_several() {
    std::ranges::stable_sort(frames_, {}, &TimedFrame::at);
    AdvisedHost host(test::servo_config(1));
    for (const TimedFrame& frame : frames_) host.adviser.on_query(frame);
    return host.count(AdviceKind::kSeveralHosts) > 0;
  }

 private:
  std::vector<TimedFrame> frames_;
};

TEST(AdviceHosts, DetectsTwoPrograms) {
  Merged alternating;
  alternating.add(0ms, 10ms, 20, target(90));
  alternating.add(3ms, 10ms, 20, target(-20));
  EXPECT_TRUE(alternating.are_several());
  Merged slower;
  slower.add(0ms, 5ms, 150, target(50));
  slower.add(2ms, 51ms, 14, query(protocol::Torque{0}));
  EXPECT_TRUE(slower.are_several());
  Merged double_rate;
  double_rate.add(0ms, 7ms, 40, target(50));
  double_rate.add(3ms, 14ms, 20, target(-20));
  EXPECT_TRUE(double_rate.are_several());
}

TEST(AdviceHosts, IgnoresOneHostThatReverses) {
  AdvisedHost host(test::servo_config(1));
  const auto torque = [](double iq_A) { return query(protocol::Torque{iq_A}); };
  const auto reversed = [](int n) { return query(Position2{0, cdeg(n % 2 == 0 ? 30 : -30)}); };
  // A new target every 200 ms, sent once or repeatedly.
  for (int n = 0; n < 20; ++n) host.repeat(1, 200ms, reversed(n));
  for (int n = 0; n < 10; ++n) host.repeat(20, 10ms, reversed(n));
  // Dither against friction.
  for (int n = 0; n < 200; ++n) host.repeat(1, 2ms, torque(n % 2 == 0 ? 1.0 : -1.0));
  // A sine.
  for (int n = 0; n < 500; ++n) host.repeat(1, 2ms, speed(200 * std::sin(0.1 * n)));
  // Bang-bang in pairs, and dither around a gravity torque.
  for (int n = 0; n < 200; ++n) host.repeat(1, 2ms, torque(n % 4 < 2 ? 5.0 : 0.0));
  for (int n = 0; n < 200; ++n) host.repeat(1, 2ms, torque(n % 2 == 0 ? 1.5 : 2.5));
  // A derivative term with a coarse encoder.
  for (int n = 0; n < 400; ++n) host.repeat(1, 1ms, torque(n % 10 == 0 ? 1.5 : 1.0));
  std::uint32_t random = 1;
  for (int n = 0; n < 20'000; ++n) {  // noise of +-2 A at 1 kHz, for 20 s
    random = random * 1664525 + 1013904223;
    const double noise_A = 4.0 * (random >> 8U) / (1U << 24U) - 2;
    host.receive(host.bus.time() + n * 1ms, torque(noise_A));
  }
  EXPECT_EQ(host.count(AdviceKind::kSeveralHosts), 0U) << host.all();
}

double between(std::mt19937& random, double least, double most) {
  // From the generator's own bits, since the results of library distributions differ.
  return least + (most - least) * static_cast<double>(random()) / 4294967296.0;
}
SimTime ms(double value) { return SimTime(std::llround(value * 1e6)); }

/// A single-threaded program that sends a few values, in a pattern or randomly. Its period varies.
/// Sometimes it is delayed; then it continues, catches up at once, or stops the drive.
class LoneHost {
 public:
  explicit LoneHost(unsigned seed) : random_(seed) {
    for (double& value : values_) value = between(random_, -300, 300);
    if (chance(0.2)) values_[1] = 0;
    pattern_.resize(1 + random_() % 6);
    for (std::size_t& place : pattern_) place = random_() % values_.size();
    const double period_ms = between(random_, 0.5, 20);
    const double jitter = chance(0.3) ? 0 : between(random_, 0, 0.5);
    const bool keeps_schedule = chance(0.5);
    const double held_up = chance(0.3) ? 0 : between(random_, 0, 0.2);
    const bool catches_up = chance(0.5);
    blips_ = chance(0.5) ? between(random_, 0, 0.3) : 0;
    by_chance_ = chance(0.3);
    two_kinds_ = chance(0.3);
    double due_ms = 0;
    double now_ms = 0;
    while (now_ms < 3000) {
      due_ms = (keeps_schedule ? due_ms : now_ms) + period_ms;
      double at_ms = due_ms + period_ms * jitter * between(random_, 0, 1);
      if (chance(held_up)) at_ms += between(random_, 0, 5) * period_ms;
      at_ms = std::max(at_ms, now_ms + 0.02);
      if (!catches_up) due_ms = std::max(due_ms, at_ms);
      now_ms = at_ms;
      frames.push_back({ms(now_ms), next()});
    }
  }

  std::vector<TimedFrame> frames;

 private:
  bool chance(double of_one) { return between(random_, 0, 1) < of_one; }
  protocol::Frame next() {
    const bool blip = chance(blips_);
    const std::size_t place =
        by_chance_ ? random_() % values_.size() : pattern_[n_++ % pattern_.size()];
    if (!blip) return speed(values_[place]);
    return two_kinds_ ? query(protocol::Torque{0}) : speed(0);
  }

  std::mt19937 random_;
  std::array<double, 3> values_{};
  std::vector<std::size_t> pattern_;
  std::size_t n_ = 0;
  double blips_ = 0;
  bool by_chance_ = false;
  bool two_kinds_ = false;
};

TEST(AdviceHosts, IgnoresASingleHost) {
  for (unsigned seed = 1; seed <= 1000; ++seed) {
    const LoneHost lone(seed);
    AdvisedHost host(test::servo_config(1), 0);
    for (const TimedFrame& frame : lone.frames) host.adviser.on_query(frame);
    EXPECT_EQ(host.count(AdviceKind::kSeveralHosts), 0U) << "seed " << seed << '\n' << host.all();
  }
}

TEST(AdviceHosts, DetectsTwoHostsAtAnyPeriods) {
  int found = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    std::mt19937 random(seed);
    Merged both;
    for (const double deg : {90.0, -20.0}) {
      const double period_ms = between(random, 2, 20);
      both.add(ms(between(random, 0, period_ms)), ms(period_ms),
               static_cast<int>(10'000 / period_ms), target(deg));
    }
    found += both.are_several() ? 1 : 0;
  }
  EXPECT_EQ(found, 200);
}

}  // namespace advice_hosts_test
}  // namespace lk::emulator
