// Drives that adopt another ID or bit rate (docs/reference/protocol.md §10.9), with effects of
// power, time and flash. Frames by hand.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <string_view>
#include <vector>

#include "tests/emulator/core/faults/fault_support.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace moved_drives_test {

using namespace std::chrono_literals;
using test::frame;
using test::Host;

ServoConfig drive(int id) {
  ServoConfig config = test::powered_drive(id);
  config.generation = Generation::kV236b;
  config.quirks = quirks_of(Generation::kV236b);
  config.profile.series = Series::kMg;
  return config;
}

BusConfig two(std::int64_t bitrate = 0) {
  BusConfig config = test::bus_config({}, bitrate);
  config.servos = {drive(1), drive(7)};
  return config;
}

void save_id_nine(Host& host) {
  host.ask("147#42050A0009000000");
  host.ask("147#4405FA0000000000");
}

std::size_t replies_to(Host& host, std::string_view query, SimTime window = 0ns) {
  return host.talk(frame(query), window).size();
}

TEST(MovedDrives, ANewIdIsFoundHoweverTimeIsSplit) {
  for (const bool split : {false, true}) {
    Host host(two());
    save_id_nine(host);
    host.bus.apply({7, PowerOff{}});
    host.wait(1s);
    host.bus.apply({7, PowerOn{}});
    const SimTime query = host.bus.time() + 100ms;
    if (split) host.bus.advance_to(query - 1ms);
    host.bus.receive({query, frame("149#9C00000000000000")});
    host.bus.advance_to(query);
    std::vector<TimedFrame> heard;
    host.bus.take_replies(heard);
    EXPECT_EQ(std::ranges::count(heard, 0x149U, [](const TimedFrame& one) { return one.frame.id; }),
              1)
        << split;
  }
}

TEST(MovedDrives, ADeadDriveAtAnotherRateDestroysNothingHoweverTimeIsSplit) {
  for (const bool split : {false, true}) {
    BusConfig config = two(1'000'000);
    config.servos[1].rom.can_rate = 3;
    config.servos[1].profile.drive.inverter.f_pwm = 16e3;  // its motor may lag
    Host host(config);
    host.bus.apply({7, PowerOff{}});
    const SimTime query = host.bus.time() + 1s;
    if (split) host.bus.advance_to(query - 1ms);
    host.bus.receive({query, frame("141#9C00000000000000")});
    host.bus.advance_to(query + 20ms);
    EXPECT_EQ(host.bus.stats().error_frames, 0U) << split;
  }
}

TEST(MovedDrives, AChangedRateDisturbsFromThenOnAndNoLonger) {
  Host host(two(1'000'000));
  Registers value = host.bus.servo(7).rom;
  value.can_rate = 3;
  host.bus.write_setting(7, RomParameter::kCanRate, value);
  EXPECT_EQ(replies_to(host, "141#9C00000000000000", 20ms), 1U + 16U);
  value.can_rate = 3;
  host.bus.write_setting(7, RomParameter::kCanRate, value);  // unchanged value
  EXPECT_EQ(replies_to(host, "141#9C00000000000000", 20ms), 1U);
  value.can_rate = 4;
  host.bus.write_setting(7, RomParameter::kCanRate, value);
  EXPECT_EQ(replies_to(host, "147#9C00000000000000", 20ms), 1U);
  EXPECT_EQ(host.bus.stats().error_frames, 16U);
}

TEST(MovedDrives, TheSecondDriveOfAFaultMovesToo) {
  Host host(two());
  test::inject(host, "duplicate_id", {}, {}, {7});
  for (const char* query :
       {"147#42050A0009000000", "147#4405FA0000000000", "147#0700000000000000"}) {
    host.talk(frame(query));
  }
  EXPECT_EQ(replies_to(host, "147#9C00000000000000"), 0U);
  EXPECT_EQ(replies_to(host, "149#9C00000000000000"), 2U);
}

TEST(MovedDrives, TheSecondDriveIsOnTheBusOfTheFirst) {
  BusConfig config = two();
  config.servos[1].rom.bus_type = 1;
  Host host(config);
  test::inject(host, "duplicate_id", {}, {}, {7});
  EXPECT_EQ(replies_to(host, "147#9C00000000000000"), 0U);
}

TEST(MovedDrives, WhatADiskHasLostIsSavedAgain) {
  Host host(two());
  const Registers before = host.bus.servo(7).rom;
  const RomWear wear = host.bus.servo(7).wear;
  save_id_nine(host);
  host.wait(1ms);  // the flash has finished
  std::vector<RomWrite> written;
  host.bus.take_rom_writes(written);
  host.bus.restore_rom(7, before, wear);
  EXPECT_EQ(host.bus.servo(7).rom, before);
  EXPECT_EQ(host.ask("147#4405FA0000000000"), frame("147#4405010000000000"));
  EXPECT_EQ(host.bus.servo(7).rom.driver_id, 9);
  EXPECT_EQ(host.bus.stats().rom_writes, 2U);
}

TEST(MovedDrives, SeveralAnswerInTheOrderOfTheIdsThatTheyHaveNow) {
  BusConfig config = two();
  for (ServoConfig& servo : config.servos) servo.rom.broadcast_mode = true;
  config.servos[0].rom.driver_id = 9;
  Host host(config);
  const auto replies = host.talk(frame("281#6801680168016801"));
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_EQ(replies[0].id, 0x147U);
  EXPECT_EQ(replies[1].id, 0x149U);
}

TEST(MovedDrives, AnIdChangedByAFaultCountsAsWritten) {
  Host host(two());
  test::inject(host, "id_changed", {9.0}, {}, {7});
  EXPECT_EQ(host.bus.servo(7).wear[static_cast<std::size_t>(RomParameter::kDriverId)], 1U);
}

}  // namespace moved_drives_test
}  // namespace lk::emulator
