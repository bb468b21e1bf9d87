// Advice on unasked motion, with hosts that make the mistake.

#include <gtest/gtest.h>

#include <deque>

#include "tests/emulator/advice/advice_support.hpp"
#include "tests/emulator/core/core_support.hpp"
#include "tests/emulator/core/faults/fault_support.hpp"

namespace lk::emulator {
namespace advice_unasked_test {

using protocol::ClearErrors;
using protocol::Position1;
using protocol::ReadMultiTurnAngle;
using protocol::ReadState2;
using protocol::Speed;
using protocol::Stop;

protocol::Frame target(double deg) {
  return query(Position1{static_cast<std::int32_t>(100 * deg)});
}

ServoConfig geared() {
  ServoConfig servo = test::servo_config(1);  // the rotor boots at 45 degrees
  servo.profile.drive.mechanics.gear_ratio = 6;
  return servo;
}

// --- lunge

TEST(AdviceLunge, WarnsOnAFirstTargetWithoutAnAngle) {
  AnsweredHost host(test::servo_config(1));
  host.repeat(1, 2ms, "141#9A00000000000000");
  host.repeat(1, 2s, target(135));
  ASSERT_EQ(host.count(AdviceKind::kLunge), 1U) << host.all();
  const Advice lunge = host.get(AdviceKind::kLunge);
  EXPECT_NEAR(lunge.found.numbers[0], 90, 1);
  EXPECT_NEAR(lunge.found.numbers[1], host.bus.view(1).unasked.dps(), 1e-9);
  EXPECT_EQ(lunge.frame, target(135));
  EXPECT_EQ(lunge.first, SimTime(2ms));
  EXPECT_EQ(host.adviser.mark_of(2), "lunge");
  EXPECT_NE(host.what(AdviceKind::kLunge).find("no angle since the start"), std::string::npos);
}

/// A rotor turn is a sixth of an output turn.
TEST(AdviceLunge, IgnoresMotionsOfUpToFiveDegreesOfTheOutput) {
  for (const double output_deg : {4.5, -4.5, 6.0, -6.0}) {
    AnsweredHost host(geared());
    host.repeat(1, 2s, target(45 + 6 * output_deg));
    EXPECT_EQ(host.count(AdviceKind::kLunge), std::abs(output_deg) > 5 ? 1U : 0U) << output_deg;
  }
}

/// A rotor turn that a restart loses.
TEST(AdviceLunge, WarnsOnATargetByTheTurnCountFromBeforeARestart) {
  AnsweredHost host(geared());
  host.repeat(1, 2ms, query(ReadMultiTurnAngle{}));
  host.repeat(1, 3s, target(400));
  host.bus.power_cycle(1);
  host.wait(20ms);
  host.repeat(1, 1s, target(410));  // 10 degrees by the old count, 370 by the new one
  EXPECT_EQ(host.count(AdviceKind::kLunge), 1U) << host.all();
}

/// Lost-input protection trips, the loaded arm falls, the host clears the error and goes on.
TEST(AdviceLunge, WarnsOnTheOldTargetAfterAnError) {
  ServoConfig servo = test::servo_config(1);
  servo.rom.protections[static_cast<std::size_t>(model::Error::kLostInput)] = {true, 0.1, 0, 0};
  AnsweredHost host(servo);
  host.repeat(1, 2ms, query(ReadMultiTurnAngle{}));
  host.repeat(50, 10ms, target(90));
  host.wait(200ms);
  host.bus.apply({1, TurnShaft{-86}});
  host.repeat(1, 10ms, query(ClearErrors{}));
  host.repeat(1, 10ms, query(protocol::Run{}));
  host.repeat(100, 10ms, target(90));
  ASSERT_EQ(host.count(AdviceKind::kLunge), 1U) << host.all();
  EXPECT_NEAR(host.get(AdviceKind::kLunge).found.numbers[0], 86, 4);
}

TEST(AdviceLunge, NamesTheRunThatResumesAStoppedMotion) {
  AnsweredHost host(test::servo_config(1));  // legacy: 0x88 resumes
  host.repeat(1, 2ms, query(ReadMultiTurnAngle{}));
  host.repeat(1, 1s, target(90));
  host.repeat(1, 10ms, query(Stop{}));
  host.bus.apply({1, TurnShaft{60}});
  host.repeat(1, 1s, query(protocol::Run{}));
  ASSERT_EQ(host.count(AdviceKind::kLunge), 1U) << host.all();
  EXPECT_EQ(host.get(AdviceKind::kLunge).frame, query(protocol::Run{}));
}

// --- left-turning

AnsweredHost& leave_turning(AnsweredHost& host) {
  host.repeat(1, 10ms, query(ReadMultiTurnAngle{}));
  host.repeat(50, 10ms, query(Speed{360, 0}));
  return host;
}

TEST(AdviceLeftTurning, WarnsOnASilentHost) {
  AnsweredHost host(test::servo_config(1));
  leave_turning(host).wait(900ms);
  EXPECT_EQ(host.count(AdviceKind::kLeftTurning), 0U) << host.all();
  host.wait(2s);
  EXPECT_EQ(host.count(AdviceKind::kLeftTurning), 1U) << host.all();
  EXPECT_EQ(host.count(AdviceKind::kLunge), 0U) << host.all();
  EXPECT_EQ(host.get(AdviceKind::kLeftTurning).frame, query(Speed{360, 0}));
}

TEST(AdviceLeftTurning, IgnoresStoppedDrivesAndTheProtection) {
  AnsweredHost stops(test::servo_config(1));
  leave_turning(stops).repeat(1, 3s, query(Stop{}));
  EXPECT_EQ(stops.count(AdviceKind::kLeftTurning), 0U) << stops.all();
  ServoConfig servo = test::servo_config(1);
  servo.rom.protections[static_cast<std::size_t>(model::Error::kLostInput)] = {true, 3, 0, 0};
  AnsweredHost guarded(servo);
  leave_turning(guarded).wait(4s);
  EXPECT_EQ(guarded.count(AdviceKind::kLeftTurning), 0U) << guarded.all();
}

// --- stale-backlog

/// Sends a query every 10 ms; for half a second, nothing acknowledges.
AnsweredHost& cut_off(AnsweredHost& host, const protocol::Frame& frame) {
  host.repeat(20, 10ms, frame);
  host.bus.apply({kWholeBus, SetFault{test::fault("no_ack", {}, {.duration = 500ms}, {})}});
  host.repeat(100, 10ms, frame);
  return host;
}

/// 40 frames of the first 400 ms of the cut are older than 100 ms when it ends. The queue then
/// takes 50 times 0.3 ms at most, in which up to two more get so old.
void expect_stale(const AnsweredHost& host) {
  EXPECT_GE(host.bus.stats().stale, 40U);
  EXPECT_LE(host.bus.stats().stale, 42U);
}

TEST(AdviceStaleBacklog, CountsCommandsThatWaited) {
  AnsweredHost host(test::servo_config(1));
  cut_off(host, target(45));
  expect_stale(host);
  ASSERT_EQ(host.count(AdviceKind::kStaleBacklog, kWholeBus), host.bus.stats().stale) << host.all();
  const Advice stale = host.get(AdviceKind::kStaleBacklog, kWholeBus);
  EXPECT_NEAR(stale.found.numbers[1], 0.5, 0.01);
  EXPECT_EQ(stale.frame, target(45));
  EXPECT_EQ(host.count(AdviceKind::kFasterThanWire, kWholeBus), 0U) << "the cable was cut";
}

TEST(AdviceStaleBacklog, IgnoresQueriesAndASingleCommand) {
  AnsweredHost reads(test::servo_config(1));
  cut_off(reads, query(ReadMultiTurnAngle{}));
  expect_stale(reads);
  EXPECT_EQ(reads.count(AdviceKind::kStaleBacklog, kWholeBus), 0U) << reads.all();
  AnsweredHost one(test::servo_config(1));
  one.repeat(1, 10ms, query(ReadMultiTurnAngle{}));
  for (int round = 0; round < 3; ++round) {
    one.bus.apply({kWholeBus, SetFault{test::fault("no_ack", {}, {.duration = 500ms}, {})}});
    one.repeat(1, 1s, target(45));
  }
  EXPECT_EQ(one.bus.stats().stale, 3U);
  EXPECT_EQ(one.count(AdviceKind::kStaleBacklog, kWholeBus), 0U) << one.all();
}

/// The queries of a backlog come at wire speed. They do not tell the period of the host.
TEST(AdviceLunge, IgnoresMotionsAfterABacklogOfQueries) {
  AnsweredHost host(test::servo_config(1));
  cut_off(host, query(ReadMultiTurnAngle{}));
  host.repeat(1, 10ms, query(ReadMultiTurnAngle{}));
  host.repeat(50, 10ms, target(135));
  EXPECT_EQ(host.count(AdviceKind::kLunge), 0U) << host.all();
}

// --- first-target-zero, target-wrapped

TEST(AdviceFirstTarget, WarnsOnZeroAlthoughTheAngleWasRead) {
  AnsweredHost host(test::servo_config(1));
  host.repeat(3, 10ms, query(ReadMultiTurnAngle{}));
  host.repeat(20, 10ms, target(0));
  EXPECT_EQ(host.count(AdviceKind::kFirstTargetZero), 1U) << host.all();
  EXPECT_EQ(host.what(AdviceKind::kFirstTargetZero),
            "the first target since the start is 0, 45° from where the rotor stands");
  EXPECT_EQ(host.count(AdviceKind::kLunge), 0U) << host.all();
}

TEST(AdviceFirstTarget, AcceptsALaterZero) {
  AnsweredHost host(test::servo_config(1));
  host.repeat(3, 10ms, query(ReadMultiTurnAngle{}));
  host.repeat(100, 10ms, target(40));
  host.repeat(20, 10ms, target(0));
  EXPECT_EQ(host.count(AdviceKind::kFirstTargetZero), 0U) << host.all();
}

TEST(AdviceTargetWrapped, WarnsOnATargetBeyond32Bits) {
  const auto ask = [](const protocol::Command& command) {
    return query(command, 1, Generation::kV236);
  };
  AnsweredHost host(test::drive(Generation::kV236));
  host.repeat(1, 10ms, ask(protocol::ClearAngle{2'147'483'600}));
  host.repeat(1, 10ms, ask(ReadMultiTurnAngle{}));
  host.repeat(1, 100ms, ask(Position1{2'147'483'647}));
  EXPECT_EQ(host.count(AdviceKind::kTargetWrapped), 0U) << host.all();
  host.repeat(1, 100ms, ask(Position1{static_cast<std::int32_t>(2'147'483'648U + 1000U)}));
  EXPECT_EQ(host.count(AdviceKind::kTargetWrapped), 1U) << host.all();
}

// --- answers-shifted

/// A host that sends a query, waits for one reply at most `timeout`, and takes it for the answer.
struct NaiveHost {
  explicit NaiveHost(bool empties) : bus(config()), adviser(config()), empties_buffer(empties) {}

  static BusConfig config() { return test::bus_config({1}, 1'000'000); }
  void ask(SimTime timeout) {
    if (empties_buffer) received.clear();
    const TimedFrame in{bus.time(), query(ReadState2{})};
    adviser.on_query(in);
    bus.receive(in);
    const SimTime end = bus.time() + timeout;
    while (received.empty() && bus.time() < end) {
      bus.advance_to(bus.time() + 10us);
      for (const TimedFrame& reply : test::replies_of(bus)) {
        adviser.on_reply(reply);
        received.push_back(reply);
      }
      adviser.observe(bus);
    }
    if (!received.empty()) received.pop_front();
    bus.advance_to(bus.time() + 20us);
  }
  std::uint64_t shifted() const {
    std::uint64_t sum = 0;
    for (const Advice& advice : adviser.advice()) {
      if (advice.found.kind == AdviceKind::kAnswersShifted) sum += advice.count;
    }
    return sum;
  }

  Bus bus;
  Adviser adviser;
  std::deque<TimedFrame> received;
  bool empties_buffer;
};

TEST(AdviceAnswersShifted, WarnsAfterALateReply) {
  NaiveHost host(false);
  for (int n = 0; n < 50; ++n) host.ask(20ms);
  EXPECT_EQ(host.shifted(), 0U);
  host.bus.apply({kWholeBus, SetFault{test::fault("delay", {30.0}, {.duration = 1ms})}});
  for (int n = 0; n < 50; ++n) host.ask(20ms);
  EXPECT_GT(host.shifted(), 20U);
}

/// A correct host empties its buffer; a lost reply shifts nothing.
TEST(AdviceAnswersShifted, IgnoresDiscardedAndLostReplies) {
  for (const bool lost : {false, true}) {
    NaiveHost host(!lost);
    for (int round = 0; round < 10; ++round) {
      for (int n = 0; n < 30; ++n) host.ask(20ms);
      const Fault fault = lost ? test::fault("silent", {}, {.duration = 1ms})
                               : test::fault("delay", {30.0}, {.duration = 1ms});
      host.bus.apply({kWholeBus, SetFault{fault}});
      for (int n = 0; n < 30; ++n) host.ask(lost ? 20ms : 40ms);
    }
    EXPECT_EQ(host.shifted(), 0U) << lost;
  }
}

}  // namespace advice_unasked_test
}  // namespace lk::emulator
