// Course of a fault: start, repetition, end, evidence, names, and limits of a bus.

#include <gtest/gtest.h>

#include <random>
#include <tuple>

#include "emulator/core/faults/make_fault.hpp"
#include "tests/emulator/core/faults/fault_support.hpp"

namespace lk::emulator {
namespace faults_test {

using namespace std::chrono_literals;
using test::answers;
using test::clear;
using test::evidence;
using test::fault;
using test::Host;
using State = FaultEvidence::State;

void plan(Host& host, SimTime at, const Fault& fault,
          const std::optional<Condition>& when = std::nullopt) {
  EXPECT_TRUE(host.bus.plan({at, {kWholeBus, SetFault{fault}}, when}));
}

TEST(Faults, BeginAndEndAtTheirTimes) {
  Host host(test::bus_config({1}));
  host.wait(10ms);
  plan(host, 100ms, fault("hang", {}, {.duration = 50ms}));
  EXPECT_EQ(evidence(host).state, State::kArmed);
  EXPECT_EQ(evidence(host).armed_at, 10ms);
  EXPECT_FALSE(evidence(host).began_at);
  host.wait(89999us);
  EXPECT_TRUE(answers(host));
  host.wait(1us);
  EXPECT_EQ(evidence(host).state, State::kActive);
  EXPECT_EQ(evidence(host).began_at, 100ms);
  EXPECT_FALSE(evidence(host).first_effect_at);
  host.wait(20ms);
  EXPECT_FALSE(answers(host));
  host.wait(29999us);
  EXPECT_FALSE(answers(host));
  host.wait(1us);
  EXPECT_TRUE(answers(host));
  const FaultEvidence after = evidence(host);
  EXPECT_EQ(after.state, State::kOver);
  EXPECT_EQ(after.began_at, 100ms);
  EXPECT_EQ(after.first_effect_at, 120ms);
  EXPECT_EQ(after.effects, 2U);
  EXPECT_EQ(after.first_on, "drive 1, 141#9C00000000000000");
  EXPECT_EQ(host.bus.stats().count(Drop::kFault), 2U);
}

TEST(Faults, HaveNoEvidenceWithoutAnEffect) {
  Host host(test::bus_config({1}));
  test::inject(host, "hang", {}, {.duration = 50ms});
  test::inject(host, "encoder_stuck", {}, {.duration = 50ms});  // the shaft does not move
  test::inject(host, "rom_damaged");                            // ROM still has factory values
  host.wait(100ms);
  for (std::size_t n = 0; n < 3; ++n) {
    EXPECT_EQ(evidence(host, n).state, State::kOver) << n;
    EXPECT_FALSE(evidence(host, n).first_effect_at) << n;
    EXPECT_EQ(evidence(host, n).effects, 0U) << n;
    EXPECT_EQ(evidence(host, n).first_on, "") << n;
  }
}

TEST(Faults, RepeatAsOftenAsSet) {
  Host host(test::bus_config({1}));
  plan(host, 10ms, fault("hang", {}, {.duration = 5ms, .every = 20ms, .times = 3}));
  std::vector<int> unanswered_ms;
  for (int ms = 0; ms < 100; ++ms) {
    if (!answers(host)) unanswered_ms.push_back(ms);
    if (ms == 12 || ms == 20) {
      EXPECT_EQ(evidence(host).state, ms == 12 ? State::kActive : State::kPaused);
    }
    host.wait(1ms);
  }
  EXPECT_EQ(unanswered_ms,
            (std::vector{10, 11, 12, 13, 14, 30, 31, 32, 33, 34, 50, 51, 52, 53, 54}));
  EXPECT_EQ(evidence(host).state, State::kOver);
  EXPECT_EQ(evidence(host).began_at, 10ms);
  EXPECT_EQ(evidence(host).effects, 15U);
  EXPECT_FALSE(host.bus.next_due());
}

TEST(Faults, RepeatWithoutEndUntilCleared) {
  Host host(test::bus_config({1}));
  test::inject(host, "hang", {}, {.duration = 5ms, .every = 20ms});
  host.wait(10001ms);
  EXPECT_FALSE(answers(host));
  host.wait(10ms);
  EXPECT_EQ(evidence(host).state, State::kPaused);
  clear(host);
  host.wait(10ms);
  EXPECT_TRUE(answers(host));
  EXPECT_EQ(evidence(host).state, State::kCleared);
  EXPECT_FALSE(host.bus.next_due());
}

TEST(Faults, RepeatAlsoIfInstantaneous) {
  Host host(test::bus_config({1}));
  test::inject(host, "reset", {}, {.every = 10ms, .times = 3});
  EXPECT_EQ(evidence(host).effects, 1U);
  EXPECT_EQ(evidence(host).state, State::kPaused);
  host.wait(100ms);
  EXPECT_EQ(evidence(host).effects, 3U);
  EXPECT_EQ(evidence(host).state, State::kOver);
}

// --- clearing and names

TEST(Faults, AreClearedByNameKindOrAll) {
  Host host(test::bus_config({1, 2, 3}));
  const auto set = [&](std::string_view kind, int id, const char* name) {
    host.bus.apply({kWholeBus, SetFault{fault(kind, {}, {}, {id}, name)}});
  };
  set("hang", 1, "one");
  set("hang", 2, "two");
  set("hang", 3, "");
  set("bridge_dead", 1, "dead");
  clear(host, "unknown");
  EXPECT_FALSE(answers(host, 1) || answers(host, 2) || answers(host, 3));
  clear(host, "two");
  EXPECT_FALSE(answers(host, 1) || answers(host, 3));
  EXPECT_TRUE(answers(host, 2));
  clear(host, "hang");
  EXPECT_TRUE(answers(host, 1) && answers(host, 3));
  EXPECT_EQ(evidence(host, 3).state, State::kActive);
  clear(host, "all");
  EXPECT_EQ(evidence(host, 3).state, State::kCleared);
}

TEST(Faults, DoNotBeginOnceCleared) {
  Host host(test::bus_config({1}));
  plan(host, 50ms, fault("hang", {}));
  plan(host, 0ms, fault("hang", {}), Condition{1, CommandSeen{0x9C, 1}});
  clear(host);
  host.wait(100ms);
  EXPECT_TRUE(answers(host));
  for (std::size_t n = 0; n < 2; ++n) {
    EXPECT_EQ(evidence(host, n).state, State::kCleared);
    EXPECT_FALSE(evidence(host, n).began_at);
  }
}

TEST(Faults, StayClearedByTheirOwnTrigger) {
  Host host(test::bus_config({1}));
  const Condition seen{1, CommandSeen{0x9C, 1}};
  ASSERT_TRUE(host.bus.plan({0ms, {kWholeBus, ClearFault{"all"}}, seen}));
  plan(host, 0ms, fault("hang", {}), seen);
  EXPECT_TRUE(answers(host));
  EXPECT_TRUE(answers(host));
  EXPECT_EQ(evidence(host).state, State::kCleared);
}

TEST(Faults, HaveUniqueNames) {
  Host host(test::bus_config({1}));
  for (const char* name : {"", "", "x", "x", "hang", ""}) {
    plan(host, 1s, fault("hang", {}, {}, {1}, name));
  }
  std::vector<std::string> names;
  for (const FaultReport& report : host.bus.faults()) names.push_back(report.fault.name);
  EXPECT_EQ(names, (std::vector<std::string>{"hang", "hang-2", "x", "x-2", "hang-3", "hang-4"}));
}

// --- several faults at once

TEST(Faults, AddUpOnOneDriveAndEndSeparately) {
  Host host(test::bus_config({1}));
  const auto temperature_C = [&] { return host.state_2().temperature_C; };
  test::inject(host, "temperature_off", {5}, {.duration = 30ms});
  host.wait(10ms);
  test::inject(host, "temperature_off", {7}, {.duration = 30ms});
  host.wait(10ms);
  EXPECT_EQ(temperature_C(), 37);  // 25, 5 and 7
  host.wait(15ms);
  EXPECT_EQ(temperature_C(), 32);
  host.wait(10ms);
  EXPECT_EQ(temperature_C(), 25);
  // One sample a millisecond, plus one at its end, independent of other faults.
  EXPECT_EQ(evidence(host, 0).effects, 30U);
  EXPECT_EQ(evidence(host, 1).effects, 30U);
}

TEST(Faults, ActOnlyOnTheirDrives) {
  Host host(test::bus_config({1, 2, 3, 4}));
  host.bus.apply({kWholeBus, SetFault{fault("hang", {}, {}, {2, 4})}});
  EXPECT_TRUE(answers(host, 1));
  EXPECT_FALSE(answers(host, 4));
  EXPECT_TRUE(answers(host, 3));
  EXPECT_FALSE(answers(host, 2));
  EXPECT_EQ(evidence(host).effects, 2U);
  EXPECT_EQ(evidence(host).first_on, "drive 4, 144#9C00000000000000");
}

TEST(Faults, OfTheConfigurationBeginAlsoInACopiedBus) {
  BusConfig config = test::bus_config({1});
  config.events = {{10ms, {kWholeBus, SetFault{fault("hang", {}, {.duration = 20ms})}}}};
  Host host(config);
  host.wait(15ms);
  Host copy = host;
  EXPECT_FALSE(answers(copy));
  EXPECT_EQ(evidence(copy).effects, 1U);
  EXPECT_EQ(evidence(host).effects, 0U);
  for (Host* one : {&host, &copy}) {
    one->wait(14999us);
    EXPECT_FALSE(answers(*one));
    one->wait(1us);
    EXPECT_TRUE(answers(*one));
  }
}

TEST(Faults, BeyondTheLimitAreRefused) {
  Host host(test::bus_config({1}));
  for (std::size_t n = 0; n < Bus::kMaxFaults; ++n) {
    EXPECT_FALSE(host.bus.state().faults.full());
    plan(host, 1s, fault("bridge_dead", {}, {}, {1}, std::to_string(n)));
  }
  EXPECT_TRUE(host.bus.state().faults.full());
  const Directive one_more{kWholeBus, SetFault{fault("hang", {})}};
  EXPECT_FALSE(host.bus.apply(one_more));
  EXPECT_FALSE(host.bus.plan({0ms, one_more}));
  host.wait(1ms);
  EXPECT_TRUE(answers(host));
  EXPECT_EQ(host.bus.faults().size(), Bus::kMaxFaults);
  EXPECT_TRUE(host.bus.apply({1, TurnShaft{10}}));
}

TEST(Faults, NewOneReplacesTheOldestFinished) {
  Host host(test::bus_config({1}));
  const auto inject = [&](const char* word, std::size_t n) {
    return host.bus.apply(
        {kWholeBus, SetFault{fault(word, {}, {}, {1}, word + std::to_string(n))}});
  };
  ASSERT_TRUE(inject("bridge_dead", 0));  // lasting
  for (std::size_t n = 1; n < Bus::kMaxFaults; ++n) ASSERT_TRUE(inject("reset", n));
  EXPECT_FALSE(host.bus.state().faults.full());
  ASSERT_TRUE(inject("reset", Bus::kMaxFaults));
  const std::vector<FaultReport> kept = host.bus.faults();
  ASSERT_EQ(kept.size(), Bus::kMaxFaults);
  EXPECT_EQ(kept[0].fault.name, "bridge_dead0");
  EXPECT_EQ(kept[1].fault.name, "reset2");
  EXPECT_EQ(kept.back().fault.name, "reset" + std::to_string(Bus::kMaxFaults));
  EXPECT_EQ(host.bus.state().faults.armed(), Bus::kMaxFaults + 1);
  EXPECT_EQ(host.bus.state().faults.unfinished(), 1U);
}

TEST(Faults, LastArmedTakesPrecedenceAfterReplacement) {
  Host host(test::bus_config({1}));
  const auto inject = [&](Fault what) { return host.bus.apply({kWholeBus, SetFault{what}}); };
  ASSERT_TRUE(inject(fault("reset")));
  ASSERT_TRUE(inject(make_fault("wrong_dlc", {{"dlc", 3}}, {1})));
  for (std::size_t n = 2; n < Bus::kMaxFaults; ++n) ASSERT_TRUE(inject(fault("reset")));
  ASSERT_TRUE(inject(make_fault("wrong_dlc", {{"dlc", 2}}, {1})));
  host.wait(1s);  // the drive has started
  const auto replies = host.talk(test::frame("141#9C00000000000000"), 10ms);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies[0].dlc, 2);
}

TEST(Faults, ClearedOnesMakeRoom) {
  Host host(test::bus_config({1}));
  const auto plan_one = [&](SimTime at) {
    return host.bus.plan({at, {kWholeBus, SetFault{fault("bridge_dead")}}});
  };
  for (std::size_t n = 0; n < Bus::kMaxFaults; ++n) ASSERT_TRUE(plan_one(1s));
  EXPECT_TRUE(host.bus.state().faults.full());
  host.bus.apply({kWholeBus, ClearFault{"all"}});
  EXPECT_FALSE(host.bus.state().faults.full());
  ASSERT_TRUE(plan_one(2s));
  host.wait(1500ms);  // a cleared fault is not replaced by another
  EXPECT_FALSE(host.bus.faults().back().evidence.began_at);
  host.wait(1s);
  EXPECT_EQ(host.bus.faults().back().evidence.began_at, 2s);
}

// --- determinism

/// Returns replies and evidence of a run with faults of many kinds, cut into about `slices` random
/// slices.
std::pair<std::vector<TimedFrame>, std::vector<FaultReport>> sliced_run(int slices,
                                                                        std::uint64_t seed) {
  BusConfig config = test::powered_bus({1, 2, 3}, 1'000'000);
  config.seed = seed;
  config.servos[1].profile.drive.inverter.f_pwm = 20e3;
  const auto add = [&](SimTime at, const Fault& fault, std::optional<Condition> when = {}) {
    config.events.push_back({at, {kWholeBus, SetFault{fault}}, when});
  };
  add(5ms, fault("encoder_noise", {1}, {.duration = 30ms}, {1, 2}));
  add(10ms, fault("hang", {}, {.duration = 7ms, .every = 31ms}, {1, 3}));
  add(12ms, fault("ram_flipped", {RomParameter::kGains}, {.every = 13ms}, {1, 2, 3}));
  add(20ms, fault("encoder_drift", {90}, {}, {2}));
  add(20ms, fault("dip", {1}, {.duration = 20ms, .every = 90ms, .times = 2}, {3}));
  add(0ms, fault("jam", {100}, {.duration = 40ms}, {2}),
      Condition{1, SignalReaches{find_signal("speed_dps"), Edge::kAbove, 50}});
  add(0ms, fault("slow_replies", {1.5}, {.duration = 40ms}, {1}),
      Condition{1, CommandSeen{0x92, 4}});
  Bus bus(config);
  std::mt19937 generator(static_cast<unsigned>(slices));
  std::uniform_int_distribution<std::int64_t> cut(0, 2 * 300'000'000 / slices);
  const char* const kinds[] = {"#9C00000000000000", "#A200000050460000", "#32000A0B0C0D0E0F",
                               "#9200000000000000"};
  for (int n = 0; n < 400; ++n) {
    const SimTime at = n * 700us;
    while (bus.time() < at) bus.advance_to(std::min(at, bus.time() + SimTime(cut(generator))));
    bus.receive({at, test::frame("14" + std::to_string(1 + n % 3) + kinds[n / 3 % 4])});
  }
  bus.advance_to(300ms);
  std::vector<TimedFrame> replies;
  bus.take_replies(replies);
  return {replies, bus.faults()};
}

auto values(const FaultEvidence& e) {
  return std::tuple(e.state, e.began_at, e.first_effect_at, e.effects, e.first_on);
}

TEST(Faults, DoNotDependOnSlices) {
  const auto [replies, faults] = sliced_run(1, 7);
  EXPECT_GT(replies.size(), 200U);
  for (const FaultReport& report : faults) {
    EXPECT_TRUE(report.evidence.first_effect_at) << report.fault.name;
  }
  for (const int slices : {300, 5000}) {
    const auto [other_replies, other_faults] = sliced_run(slices, 7);
    EXPECT_EQ(replies, other_replies) << slices;
    ASSERT_EQ(faults.size(), other_faults.size());
    for (std::size_t n = 0; n < faults.size(); ++n) {
      EXPECT_EQ(values(faults[n].evidence), values(other_faults[n].evidence))
          << faults[n].fault.name << ", slices " << slices;
    }
  }
  EXPECT_NE(replies, sliced_run(1, 8).first);  // another seed
}

}  // namespace faults_test
}  // namespace lk::emulator
