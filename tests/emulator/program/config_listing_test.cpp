// The listing of drives at the start.

#include "emulator/io/program/config_listing.hpp"

#include <gtest/gtest.h>

#include "tests/support/profile.hpp"
#include "tests/support/serial_bus.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace config_listing_test {

/// docs/reference/protocol.md §10.1, written here a second time.
TEST(DriveListing, NamesGenerationAndLayoutOfEachDrive) {
  BusConfig bus = test::bus_config({});
  bus.interface = "vcan0";
  bus.servos = {test::drive(Generation::kLegacy, Series::kMf, 1),
                test::drive(Generation::kLegacy, Series::kMf, 2),
                test::drive(Generation::kLateLegacy, Series::kMf, 3),
                test::drive(Generation::kV236, Series::kMg, 7)};
  for (ServoConfig& servo : bus.servos) servo.profile.drive.encoder.bits = 14;
  Profile& geared = bus.servos[3].profile;
  geared.drive.encoder.bits = 18;
  geared.drive.mechanics.gear_ratio = 10;
  geared.encoder_span = EncoderSpan::kOutputTurn;
  EXPECT_EQ(
      protocol_summary(bus),
      (std::vector<std::string>{"vcan0:3: late-legacy: 0x9A voltage 0.1 V in bytes 3-4, 0x94 "
                                "single-turn angle 0.01° in bytes 4-7, encoder 14 bits a turn",
                                "vcan0:1,2: legacy: 0x9A voltage 0.1 V in bytes 3-4, 0x94 "
                                "single-turn angle 0.01° in bytes 6-7, encoder 14 bits a turn",
                                "vcan0:7: v236: 0x9A voltage 0.01 V in bytes 2-3, 0x94 "
                                "single-turn angle 0.01° in bytes 4-7, encoder 16 bits a turn of "
                                "the output"}));
  bus.servos.resize(1);
  bus.servos[0].quirks.dialect.wide_single_turn = true;
  EXPECT_EQ(protocol_summary(bus)[0].substr(0, 23), "vcan0:1: legacy mixed: ");
}

TEST(DriveListing, NamesRs485FieldPositions) {
  BusConfig bus = test::serial_bus(
      {test::serial_drive(Generation::kLegacy, 1), test::serial_drive(Generation::kV235, 2)});
  bus.interface = "rs485:/tmp/arm";
  for (ServoConfig& servo : bus.servos) servo.profile.drive.encoder.bits = 14;
  EXPECT_EQ(
      protocol_summary(bus),
      (std::vector<std::string>{"rs485:/tmp/arm:1: legacy: 0x9A voltage 0.1 V in D[2:3], "
                                "0x94 single-turn angle 0.01° in D[0:3], encoder 14 bits a turn",
                                "rs485:/tmp/arm:2: v235: 0x9A voltage 0.01 V in D[1:2], "
                                "0x94 single-turn angle 0.01° in D[0:3], encoder 14 bits a turn"}));
}

TEST(ConfigListing, NamesTheAdapterOfABus) {
  BusConfig bus = test::bus_config({1}, 1'000'000);
  EXPECT_EQ(describe_run({bus}).substr(0, 22), "test: 1 Mbit/s, 1 driv");
  bus.adapter = find_adapter("ch348");
  EXPECT_EQ(describe_run({bus}).substr(0, 38), "test: 1 Mbit/s, adapter ch348, 1 drive");
}

TEST(ConfigListing, CountsOneDriveInTheSingular) {
  EXPECT_NE(describe_run({test::bus_config({1})}).find(" 1 drive, "), std::string::npos);
  EXPECT_NE(describe_run({test::bus_config({1, 2})}).find(" 2 drives, "), std::string::npos);
}

/// A hip drive with a speed Kp of 250 rings at 300 Hz against its gear.
TEST(ConfigListing, NamesOscillatingLoops) {
  BusConfig bus = test::bus_config({1}, 1'000'000);
  ServoConfig& servo = bus.servos[0];
  servo.profile = test::profile("mg6010");
  servo.rom = servo.profile.factory;
  servo.profile.drive.load.J = 0.03;  // ten rotors
  const std::string note = "note: test drive 1: the ";
  EXPECT_EQ(describe_run({bus}).find(note), std::string::npos);
  servo.rom.gains.speed_kp = 250;
  EXPECT_NE(
      describe_run({bus}).find(note + "speed loop rings with these gains and this load: margins"
                                      " of -"),
      std::string::npos)
      << describe_run({bus});
  // A load too heavy for the angle gain; the speed loop alone would be stable.
  servo.rom = servo.profile.factory;
  servo.profile.drive.load.J = 0.3;
  EXPECT_NE(describe_run({bus}).find(note + "position loop rings"), std::string::npos)
      << describe_run({bus});
}

DriveAddress rom_place(const ServoConfig& servo) { return drive_address(servo.rom, servo); }

TEST(PlaceNote, NamesDrivesThatShareAnId) {
  BusConfig bus = test::bus_config({});
  for (const int id : {1, 2, 3}) {
    bus.servos.push_back(test::drive(Generation::kV236b, Series::kMg, id));
  }
  const auto note = [&](std::size_t n) { return place_note(bus.servos[n], bus, rom_place); };
  bus.servos[0].rom.driver_id = 2;
  EXPECT_EQ(note(0), "answers at ID 2, as drive 2 does");
  EXPECT_EQ(note(1), "");
  bus.servos[2].rom.driver_id = 2;
  EXPECT_EQ(note(0), "answers at ID 2, as drives 2, 3 do");
  bus.servos[0].rom.driver_id = 9;
  bus.servos[2].rom.driver_id = 3;
  EXPECT_EQ(note(0), "answers at ID 9");
  bus.servos[1].rom.driver_id = 9;
  bus.servos[1].rom.can_rate = 3;  // it receives nothing on this bus
  EXPECT_EQ(note(0), "answers at ID 9");
  EXPECT_NE(describe_run({bus}).find("answers at ID 9"), std::string::npos);
}

/// Rate codes of the tools without 921600: 7 is 1 Mbit/s.
TEST(PlaceNote, UsesTheRateCodesOfTheDrives) {
  BusConfig bus = test::bus_config({1});
  bus.serial.emplace();
  ServoConfig& servo = bus.servos[0];
  servo.quirks.dialect.framing = protocol::Framing::kSerial;
  servo.rate_code = 4;
  servo.rom.serial_rate = 7;
  const auto note = [&] { return place_note(servo, bus, rom_place); };
  EXPECT_EQ(note(), "receives nothing, as it is set to 921600 bit/s");
  bus.serial->has_921600 = false;
  EXPECT_EQ(note(), "receives nothing, as it is set to 1000000 bit/s");
}

}  // namespace config_listing_test
}  // namespace lk::emulator
