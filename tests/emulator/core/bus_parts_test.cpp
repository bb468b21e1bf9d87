// Unit tests for the parts of a bus.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

#include "emulator/core/bus/agenda.hpp"
#include "emulator/core/bus/conditions.hpp"
#include "emulator/core/bus/memory.hpp"
#include "emulator/core/bus/motors.hpp"
#include "emulator/core/faults/acts.hpp"
#include "emulator/core/faults/fault_board.hpp"
#include "tests/support/faults.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace bus_parts_test {

using namespace std::chrono_literals;
using test::frame;

const protocol::Frame kReply = frame("141#9C19000000000000");

/// Identifiers of error frames have flags in the bits where those of replies have the drive.
TEST(TimedFrame, OnlyRepliesHaveADrive) {
  EXPECT_EQ(drive_of({0ms, {.id = 0x160}}), 32);
  EXPECT_EQ(drive_of({.frame = {.id = 0x141}, .drive_id = 7}), 7);
  EXPECT_EQ(drive_of({0ms, {.id = 0x17F}}), 0);
  EXPECT_EQ(drive_of({0ms, {.id = 0x0A1, .kind = protocol::FrameKind::kError}}), 0);
}

TEST(PowerPart, RampAdvancesInSteps) {
  Power power(24, true);
  power.move(20, 10ms, 2500us);
  EXPECT_EQ(power.step(10ms), 11ms);
  EXPECT_EQ(power.supply_V(), 24);
  EXPECT_EQ(power.step(11ms), 12ms);
  EXPECT_DOUBLE_EQ(power.supply_V(), 22.4);
  EXPECT_EQ(power.step(12ms), 12500us);
  EXPECT_EQ(power.step(12500us), std::nullopt);
  EXPECT_EQ(power.supply_V(), 20);
}

TEST(MemoryPart, QueuesWritesAndLosesThemWithoutPower) {
  ServoConfig config = test::servo_config(1);
  config.flash.write_time = 2ms;
  BusConfig bus = test::bus_config({});
  bus.servos = {config};
  Motors motors(bus);
  const Lane lane = motors.lane(motors.location_of(config, bus));
  Servo servo(config, lane.telemetry());
  Memory memory;
  Registers value = servo.rom;
  const std::int32_t before = value.acceleration_dps_s;
  for (const int acceleration_dps_s : {100, 200}) {
    value.acceleration_dps_s = acceleration_dps_s;
    write_setting(servo, RomParameter::kAcceleration, value, lane);
    EXPECT_EQ(memory.begin(1ms, servo), acceleration_dps_s == 100 ? 3ms : 5ms);
  }
  EXPECT_EQ(memory.size(), 2U);
  EXPECT_EQ(Memory(memory).finish().rom.acceleration_dps_s, 100);
  EXPECT_TRUE(memory.lose_power(servo));
  EXPECT_EQ(servo.rom.acceleration_dps_s, before);
  EXPECT_FALSE(memory.lose_power(servo));
  EXPECT_FALSE(memory.damage(RomParameter::kAcceleration, servo.rom));
}

TEST(LinkPart, HeldFrameIsSentAfterTheNext) {
  Wire wire(test::bus_config({}));
  DriveLink link{.owner = 0x141};
  Outgoing held{3ms, kReply};
  held.held_back = true;
  EXPECT_EQ(link.send_all(wire, {held}), 0U);
  EXPECT_TRUE(link.held_back);
  EXPECT_EQ(link.send_all(wire, {Outgoing{5ms, frame("141#9A19000000000000")}}), 0U);
  EXPECT_FALSE(link.held_back);
  EXPECT_EQ(wire.can()->deliver(5ms)->frame.data[0], 0x9A);
  EXPECT_EQ(wire.can()->deliver(5ms)->frame.data[0], 0x9C);  // ready earlier, but queued behind it
  EXPECT_FALSE(wire.can()->deliver(1s));
}

TEST(LinkPart, BlockedQueueFillsUpAndIsDroppedWithThePower) {
  Wire wire(test::bus_config({}));
  DriveLink link{.owner = 0x141};
  EXPECT_EQ(link.block(wire, 0ms), 0U);
  for (std::size_t n = 0; n < CanWire::kDriveQueue; ++n) {
    EXPECT_EQ(link.send(wire, Outgoing{1ms, kReply}), 0U);
  }
  EXPECT_TRUE(link.full(wire));
  EXPECT_EQ(link.send(wire, Outgoing{1ms, kReply}), 1U);
  EXPECT_FALSE(link.babble(wire, kReply, 2ms));
  EXPECT_FALSE(wire.next_due());
  EXPECT_EQ(link.drop_all(wire, 2ms), CanWire::kDriveQueue);
  link.release(wire, 2ms);
  EXPECT_TRUE(link.babble(wire, kReply, 3ms));
  EXPECT_EQ(wire.next_due(), 3ms);
}

TEST(Agenda, SamplesOnceForSeveralRequests) {
  Agenda agenda;
  agenda.schedule(2ms, SupplyStep{1});
  agenda.schedule(1ms, SagEnd{1});
  agenda.schedule(1ms, FaultEnd{7});
  agenda.sample_by(5ms);
  agenda.sample_by(6ms);  // an earlier sample is planned
  agenda.cancel<SupplyStep>(1);
  agenda.cancel_fault<FaultEnd>(8);
  EXPECT_TRUE(std::holds_alternative<SagEnd>(agenda.take()));
  EXPECT_TRUE(std::holds_alternative<FaultEnd>(agenda.take()));
  EXPECT_EQ(agenda.next_due(), 5ms);
  EXPECT_TRUE(std::holds_alternative<Sample>(agenda.take()));
  EXPECT_EQ(agenda.next_due(), std::nullopt);
}

TEST(FaultBoardPart, FaultPassesItsStatesInOrder) {
  using State = FaultEvidence::State;
  FaultBoard board(1);
  Fault hang = test::fault_of("hang", {}, {1});
  hang.duration = 1ms;
  hang.every = 5ms;
  hang.times = 2;
  EXPECT_EQ(board.arm(hang, 0ms), 0U);
  EXPECT_EQ(board.arm(test::fault_of("hang", {}, {2}), 1ms), 1U);
  EXPECT_EQ(board[1].fault.name, "hang-2");
  EXPECT_FALSE(board.any_active());
  EXPECT_TRUE(board.start(0, 2ms));
  EXPECT_TRUE(board.any_active());
  EXPECT_EQ(board.find("hang"), (std::vector<std::size_t>{0, 1}));
  EXPECT_EQ(board.find("hang-2"), (std::vector<std::size_t>{1}));
  board.stop(0);
  EXPECT_EQ(board[0].evidence.state, State::kPaused);
  EXPECT_TRUE(board.start(0, 7ms));
  board.stop(0);
  EXPECT_EQ(board[0].evidence.state, State::kOver);
  EXPECT_EQ(board[0].evidence.began_at, 2ms);
  board[1].evidence.state = State::kCleared;
  EXPECT_FALSE(board.start(1, 8ms));
  EXPECT_TRUE(board.find("all").empty());
}

TEST(FaultBoardPart, AddsTheFaultsOfEachDrive) {
  FaultBoard board(1);
  const ServoConfig servo = test::servo_config(1);
  for (const Fault& fault :
       {test::fault_of("load_step", {2}, {1}), test::fault_of("load_step", {3}, {1, 2}),
        test::fault_of("load_step", {9}, {2}), test::fault_of("rom_worn", {}, {1}),
        test::fault_of("queue_full", {}, {2})}) {
    board.start(board.arm(fault, 0ms), 0ms);
  }
  EXPECT_EQ(plant_faults(board, servo, 1ms).load_torque, 5);
  EXPECT_TRUE(firmware_faults(board, 1).rom_worn);
  EXPECT_FALSE(firmware_faults(board, 2).rom_worn);
  EXPECT_EQ(board.first(1, &FaultRow::blocks), nullptr);
  EXPECT_EQ(board.first(2, &FaultRow::blocks), &board[4]);
  const FaultedReply faulted =
      apply_to_reply(board, 2, DriveLink{.owner = 0x142}, {1ms, kReply}, 0, 1ms);
  EXPECT_EQ(faulted.out.size(), 1U);
  EXPECT_EQ(board[4].evidence.effects, 1U);
}

/// A task that `number` identifies.
Task task(int number) { return Reconnect{number}; }

std::vector<int> all_of(Agenda agenda) {
  std::vector<int> order;
  while (agenda.next_due()) order.push_back(std::get<Reconnect>(agenda.take()).id);
  return order;
}

TEST(Agenda, TakesTasksByTimeThenByEntry) {
  std::mt19937 random(1);
  Agenda agenda;
  std::vector<std::pair<int, int>> entered;
  for (int n = 0; n < 500; ++n) {
    const int at = static_cast<int>(random() % 20);
    agenda.schedule(SimTime(at), task(n));
    entered.emplace_back(at, n);
  }
  std::ranges::stable_sort(entered, {}, &std::pair<int, int>::first);
  std::vector<int> expected;
  for (const auto& [at, n] : entered) expected.push_back(n);
  EXPECT_EQ(all_of(agenda), expected);
  agenda.cancel<Reconnect>(expected[100]);
  expected.erase(expected.begin() + 100);
  EXPECT_EQ(all_of(agenda), expected) << "what is left keeps its order";
}

TEST(Agenda, CountsAndCancelsOnlyDirectives) {
  Agenda agenda;
  agenda.schedule(SimTime(2), task(1));
  agenda.schedule(SimTime(1), Directive{1, PowerOff{}});
  agenda.schedule(SimTime(3), Directive{1, PowerOn{}});
  EXPECT_EQ(agenda.directives(), 2U);
  agenda.cancel_directives();
  EXPECT_EQ(agenda.directives(), 0U);
  EXPECT_EQ(all_of(agenda), std::vector<int>{1});
}

}  // namespace bus_parts_test
}  // namespace lk::emulator
