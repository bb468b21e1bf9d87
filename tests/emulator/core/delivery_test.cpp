// Motors are advanced only when needed, without observable difference.

#include <gtest/gtest.h>

#include <random>

#include "emulator/core/scenario/sampler.hpp"
#include "tests/support/faults.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace delivery_test {

using namespace std::chrono_literals;

constexpr SimTime kEnd = 300ms;
constexpr SimTime kLook = 7ms + 300us;  // rarely coincides with a tick

/// Twelve drives with noise at two PWM rates, more than a block computes together. Some lose power
/// repeatedly and boot within a millisecond.
BusConfig restless(std::int64_t bitrate, bool with_fault) {
  BusConfig config = test::powered_bus({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, bitrate);
  for (ServoConfig& servo : config.servos) {
    servo.profile.drive.logic.boot_time = 0.001;
    servo.profile.drive.encoder.noise = 1e-4;
    servo.profile.drive.current_sensor.noise = 0.05;
    servo.profile.drive.slow_sensor.v_noise = 0.02;
    servo.flash.write_time = 3ms;
    servo.reply_time = 100us * (servo.id % 4);
  }
  config.servos[4].profile.drive.inverter.f_pwm = 24000;
  config.servos[7].profile.drive.inverter.f_pwm = 24000;
  config.servos[10].rom.broadcast_mode = true;
  for (int n = 0; n < 100; ++n) {
    // In pairs, so that of two drives that want to send, one goes first and one may be off.
    const SimTime at = n * 3ms + n % 7 * 130us;
    config.events.push_back({at, {1 + n * 5 % 12, Sag{0.0, 1500us}}});
    if (n % 2 == 0) config.events.push_back({at, {1 + (n * 5 + 1) % 12, Sag{0.0, 900us}}});
  }
  if (with_fault) {
    Fault fault = test::fault_of("drop", {}, {2, 3});
    fault.probability = 0.5;
    fault.duration = 40ms;
    config.events.push_back({120ms, {kWholeBus, SetFault{fault}}});
  }
  std::ranges::stable_sort(config.events, {}, &TimedDirective::at);
  return config;
}

/// Queries, motion, ROM writes, multi-drive commands, and the shortest frames, which show any
/// change in arbitration.
std::vector<TimedFrame> traffic(std::uint32_t seed, SimTime mean_pause) {
  std::mt19937 random(seed);
  const auto below = [&](std::int64_t n) {
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(random()) % n);
  };
  const char* const kinds[] = {"#9C00000000000000", "#A200000050460000", "#32000A0B0C0D0E0F",
                               "#9200000000000000", "#A400680110270000", "#9D00000000000000"};
  std::vector<TimedFrame> frames;
  SimTime at{0};
  while (at < kEnd) {
    at += SimTime(below(2 * mean_pause.count()));
    protocol::Frame frame = test::frame("141" + std::string(kinds[below(6)]));
    frame.id = 0x141 + below(12);
    const std::uint32_t kind = below(12);
    if (kind == 0) frame.id = 0x280;
    if (kind == 1) frame = {.id = 0x7F0, .kind = protocol::FrameKind::kRemote, .dlc = 0};
    frames.push_back({at, frame});
  }
  return frames;
}

struct Outcome {
  std::vector<TimedFrame> replies;
  std::vector<std::uint64_t> rom_writes;
  std::vector<double> seen;
  BusStats stats;
};

void look(const Bus& bus, std::vector<double>& seen) {
  for (int id = 1; id <= 12; ++id) {
    const model::Telemetry told = bus.telemetry(id);
    const model::Truth truth = bus.truth(id);
    seen.insert(seen.end(), {told.v_bus, told.i_q, told.omega, truth.theta_m, truth.v_bus,
                             static_cast<double>(told.alive),
                             static_cast<double>(bus.servo(id).run_state_at(told)),
                             static_cast<double>(bus.servo(id).ram.acceleration_dps_s)});
  }
  const BusStats stats = bus.stats();
  seen.insert(seen.end(), {static_cast<double>(stats.replies_lost),
                           static_cast<double>(stats.wire_busy.count()),
                           static_cast<double>(stats.replies_waiting)});
}

/// Sends frames at their times and reads the whole state every kLook. `bring` advances the bus
/// between these instants.
template <class Bring>
Outcome run(const BusConfig& config, const std::vector<TimedFrame>& frames, Bring bring) {
  Bus bus(config);
  Outcome out;
  SimTime next_look = kLook;
  const auto go_to = [&](SimTime until) {
    for (; next_look <= until; next_look += kLook) {
      bring(bus, next_look);
      bus.settle();
      look(bus, out.seen);
    }
    bring(bus, until);
  };
  for (const TimedFrame& in : frames) {
    go_to(in.at);
    bus.receive(in);
  }
  go_to(kEnd + 200ms);
  bus.settle();
  look(bus, out.seen);
  bus.take_replies(out.replies);
  std::vector<RomWrite> writes;
  bus.take_rom_writes(writes);
  for (const RomWrite& write : writes) {
    out.rom_writes.push_back(static_cast<std::uint64_t>(write.id) * 1000 + write.number);
  }
  out.stats = bus.stats();
  return out;
}

void expect_same(const Outcome& a, const Outcome& b) {
  ASSERT_EQ(a.replies, b.replies);
  EXPECT_EQ(a.rom_writes, b.rom_writes);
  EXPECT_EQ(a.seen, b.seen);
  EXPECT_EQ(a.stats, b.stats);
}

struct Case {
  std::int64_t bitrate;
  SimTime mean_pause;
  bool with_fault;
};

class Delivery : public ::testing::TestWithParam<Case> {};

TEST_P(Delivery, LooksTheSameHoweverFarMotorsStayBehind) {
  const auto [bitrate, mean_pause, with_fault] = GetParam();
  const BusConfig config = restless(bitrate, with_fault);
  for (std::uint32_t seed = 1; seed <= 2; ++seed) {
    const auto frames = traffic(seed, mean_pause);
    // The reference: no motor ever lags by a tick.
    const Outcome strict = run(config, frames, [](Bus& bus, SimTime until) {
      while (bus.time() < until) bus.advance_to(std::min(until, bus.time() + 10us));
    });
    EXPECT_GT(strict.replies.size(), 50U);
    EXPECT_GT(strict.stats.replies_lost, 0U);
    EXPECT_GT(strict.stats.count(Drop::kNoPower), 0U);
    expect_same(strict,
                run(config, frames, [](Bus& bus, SimTime until) { bus.advance_to(until); }));
    expect_same(strict,
                run(config, frames, [](Bus& bus, SimTime until) { bus.deliver_to(until); }));
    std::mt19937 random(seed);
    expect_same(strict, run(config, frames, [&](Bus& bus, SimTime until) {
                  while (bus.time() < until) {
                    const SimTime next = std::min(until, bus.time() + SimTime(random() % 400'000));
                    random() % 4 == 0 ? bus.advance_to(next) : bus.deliver_to(next);
                    if (random() % 16 == 0) bus.settle();
                  }
                }));
  }
}

INSTANTIATE_TEST_SUITE_P(Wires, Delivery,
                         ::testing::Values(Case{0, 1ms, false}, Case{1'000'000, 300us, false},
                                           Case{1'000'000, 120us, true}, Case{50'000, 2ms, false},
                                           Case{50'000, 3ms, true}));

// A directive acts at the bus's time, even if the drive's motor has lagged.
TEST(Delivery, WhatIsDoneToADriveIsDoneNow) {
  Bus settled(test::powered_bus({1, 2}));
  Bus behind = settled;
  for (Bus* bus : {&settled, &behind}) {
    bus->receive({0ns, test::frame("142#A200000050460000")});  // 180 dps
    bus->advance_to(0ns);
  }
  settled.advance_to(200ms);
  behind.deliver_to(200ms);
  for (Bus* bus : {&settled, &behind}) {
    bus->set_load(2, {.J = 0.01});
    bus->power_cycle(2);
    bus->advance_to(250ms);
  }
  EXPECT_GT(settled.truth(2).omega_m, 0.1);
  EXPECT_EQ(behind.truth(2).omega_m, settled.truth(2).omega_m);
  EXPECT_EQ(behind.truth(2).theta_m, settled.truth(2).theta_m);
}

/// Requests a sample every `period`, starting at `period`.
struct Watcher {
  SimTime next_due() const { return next; }
  void sample(const Bus& bus) {
    EXPECT_EQ(bus.time(), next);
    ++samples;
    next += period;
  }
  SimTime period;
  SimTime next = period;
  int samples = 0;
};

TEST(Delivery, EachWatcherLooksAtItsOwnTimes) {
  Bus bus(test::bus_config({1}));
  Watcher often{3ms};
  Watcher seldom{7ms};
  advance_watched(bus, 30ms, often, seldom);
  EXPECT_EQ(often.samples, 10);
  EXPECT_EQ(seldom.samples, 4);
  EXPECT_EQ(bus.time(), 30ms);
}

}  // namespace delivery_test
}  // namespace lk::emulator
