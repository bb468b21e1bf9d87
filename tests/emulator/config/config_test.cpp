#include "emulator/config/config.hpp"

#include <gtest/gtest.h>

#include <map>
#include <numbers>

#include "tests/emulator/config/config_support.hpp"

namespace lk::emulator {
namespace config_test {

Overrides with_bus(const std::string& interface, std::optional<std::vector<int>> ids) {
  Overrides overrides;
  overrides.buses.push_back({interface, std::move(ids)});
  return overrides;
}

constexpr const char* kMinimal = R"([[bus]]
interface = "vcan0"
[[bus.drive]]
id = 3
)";

TEST(Ids, ParseListsAndRanges) {
  EXPECT_EQ(parse_ids("1-4"), (std::vector{1, 2, 3, 4}));
  EXPECT_EQ(parse_ids("9,1,3-5"), (std::vector{1, 3, 4, 5, 9}));
  EXPECT_EQ(parse_ids("1-32").size(), 32U);
  EXPECT_EQ(parse_ids("32"), (std::vector{32}));
}

TEST(Ids, RejectMalformedLists) {
  const std::map<std::string, std::string> reasons = {
      {"0", "ID 0 is outside 1..32"},
      {"33", "ID 33 is outside 1..32"},
      {"1-33", "ID 33 is outside 1..32"},
      {"99999999999", "ID 99999999999 is outside 1..32"},
      {"1,2,1", "ID 1 is given twice"},
      {"1-4,3", "ID 3 is given twice"},
      {"4-1", "the range 4-1 runs backwards"},
      {"", "\"\" is not an ID; write 1-4 or 1,3,7-9"},
      {"1,", "\"\" is not an ID; write 1-4 or 1,3,7-9"},
      {"-1", "\"\" is not an ID; write 1-4 or 1,3,7-9"},
      {"1-2-3", "\"2-3\" is not an ID; write 1-4 or 1,3,7-9"},
      {"two", "\"two\" is not an ID; write 1-4 or 1,3,7-9"},
      {" 1", "\" 1\" is not an ID; write 1-4 or 1,3,7-9"},
  };
  for (const auto& [text, reason] : reasons) {
    EXPECT_EQ(config_error([&, &ids = text] { parse_ids(ids); }), reason);
  }
}

TEST(Config, AppliesDefaultsToTheSmallestFile) {
  const auto buses = parse(kMinimal);
  ASSERT_EQ(buses.size(), 1U);
  EXPECT_EQ(buses[0].interface, "vcan0");
  EXPECT_EQ(buses[0].bitrate, 1'000'000);
  EXPECT_EQ(buses[0].seed, kDefaultSeed);
  ASSERT_EQ(buses[0].servos.size(), 1U);
  const ServoConfig& servo = buses[0].servos[0];
  EXPECT_EQ(servo.id, 3);
  EXPECT_EQ(servo.profile.name, kDefaultMotor);
  EXPECT_EQ(servo.rom.gains, servo.profile.factory.gains);
  EXPECT_EQ(servo.quirks, Quirks{});
  EXPECT_FALSE(servo.boot_angle_deg.has_value());
}

TEST(Config, ReadsEveryKey) {
  const auto buses = parse(R"(seed = 7
bitrate = 500000
[[bus]]
interface = "vcan0"
[[bus.drive]]
ids = "2,5-6"
motor = "mg4005"
reply_time_us = 250
boot_angle_deg = -12.5
rom = { write_time_ms = 1.5, endurance_writes = 7 }
quirks = { manual_reply_bytes = true, clear_angle = "implemented", offset_write_takes_effect = false, run_resumes = false, stop_holds = true }
load = { J_g_cm2 = 1000, tau_Nm = -0.5, theta_min_deg = -90 }
[bus.drive.settings]
max_torque_current_lsb = 500
encoder_offset = 65535
gains = { angle_kp = 50 }
protection.lost_input = { enabled = true, threshold_s = 0.2, recoverable = false }
[bus.drive.profile.supply]
v_source_V = 30
[[bus]]
interface = "vcan1"
bitrate = 0
drive = [ { id = 1 } ]
)");
  ASSERT_EQ(buses.size(), 2U);
  EXPECT_EQ(buses[0].bitrate, 500'000);
  EXPECT_EQ(buses[1].bitrate, 0);
  EXPECT_EQ(buses[0].seed, 7U);
  EXPECT_NE(buses[1].seed, 7U) << "equal IDs on two buses must not be copies of each other";
  ASSERT_EQ(buses[0].servos.size(), 3U);
  const ServoConfig& servo = buses[0].servos[2];
  EXPECT_EQ(servo.id, 6);
  EXPECT_EQ(servo.profile.name, "mg4005");
  EXPECT_EQ(servo.reply_time, std::chrono::microseconds(250));
  EXPECT_EQ(servo.boot_angle_deg, -12.5);
  EXPECT_TRUE(servo.quirks.manual_reply_bytes);
  EXPECT_EQ(servo.quirks.dialect.clear_angle, protocol::ClearAngleMeaning::kImplemented);
  EXPECT_FALSE(servo.quirks.offset_write_takes_effect);
  EXPECT_FALSE(servo.quirks.run_resumes);
  EXPECT_TRUE(servo.quirks.stop_holds);
  EXPECT_EQ(servo.flash.write_time, std::chrono::microseconds(1500));
  EXPECT_EQ(servo.flash.endurance, 7U);
  EXPECT_DOUBLE_EQ(servo.profile.drive.load.J, 1e-4);
  EXPECT_DOUBLE_EQ(servo.profile.drive.load.tau, -0.5);
  EXPECT_DOUBLE_EQ(servo.profile.drive.load.theta_min, -std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(servo.profile.drive.supply.v_source, 30);
  EXPECT_EQ(servo.rom.max_torque_current_lsb, 500);
  EXPECT_EQ(servo.rom.encoder_offset, 65535);
  EXPECT_EQ(servo.rom.gains.angle_kp, 50);
  EXPECT_EQ(servo.rom.gains.angle_ki, servo.profile.factory.gains.angle_ki);
  const auto& lost = servo.rom.protections[static_cast<std::size_t>(model::Error::kLostInput)];
  EXPECT_TRUE(lost.enabled);
  EXPECT_DOUBLE_EQ(lost.threshold, 0.2);
  EXPECT_FALSE(lost.recoverable);
}

TEST(Config, ReadsAdapterNamesOfTheTable) {
  const std::string drive = "[[bus.drive]]\nid = 1\n";
  const std::string bus = "[[bus]]\ninterface = \"vcan0\"\n";
  EXPECT_EQ(parse(bus + drive)[0].adapter, nullptr);
  EXPECT_EQ(parse(bus + "adapter = \"ch348\"\n" + drive)[0].adapter, find_adapter("ch348"));
}

TEST(Config, ErrorsNameFileLineKeyAndReason) {
  const std::string bus = "[[bus]]\ninterface = \"vcan0\"\n";
  const std::map<std::string, std::string> errors = {
      {"bus = 1", "robot.toml:1: bus: must be an array of tables, [[bus]]"},
      {"", "robot.toml:1: bus: missing"},
      {"seed = -1", "robot.toml:1: seed: -1 is out of range (0 to 9223372036854775807)"},
      {"sead = 1\n" + bus + "drive = [{id=1}]",
       "robot.toml:1: sead: unknown key, did you mean seed?"},
      {"bitrate = 2000000",
       "robot.toml:1: bitrate: 2000000 is out of range (0, or 10000 to 1000000 bit/s)"},
      {bus + "bitrate = 9999",
       "robot.toml:3: bus.bitrate: 9999 is out of range (0, or 10000 to 1000000 bit/s)"},
      {bus + "adapter = \"ch349\"",
       "robot.toml:3: bus.adapter: \"ch349\" is not one of none, ch348, ftdi_default, ftdi_1ms, "
       "slcan_115200, usb_can, usb_can_hs"},
      {bus, "robot.toml:1: bus.drive: missing"},
      {"[[bus]]\n[[bus.drive]]\nid = 1", "robot.toml:1: bus.interface: missing"},
      {"[[bus]]\ninterface = \"a/b\"",
       "robot.toml:2: bus.interface: \"a/b\" is not an interface name"},
      {bus + "[[bus.drive]]", "robot.toml:3: bus.drive.id: missing"},
      {bus + "[[bus.drive]]\nid = 33", "robot.toml:4: bus.drive.id: 33 is out of range (1 to 32)"},
      {bus + "[[bus.drive]]\nid = \"1\"", "robot.toml:4: bus.drive.id: must be a whole number"},
      {bus + "[[bus.drive]]\nid = 1\nids = \"2\"",
       "robot.toml:5: bus.drive.ids: give either id or ids"},
      {bus + "[[bus.drive]]\nids = \"1-40\"",
       "robot.toml:4: bus.drive.ids: ID 40 is outside 1..32"},
      {bus + "[[bus.drive]]\nid = 1\n[[bus.drive]]\nid = 1",
       "robot.toml:6: bus.drive.id: ID 1 is given twice on this bus"},
      {bus + "[[bus.drive]]\nid = 1\n" + bus + "[[bus.drive]]\nid = 1",
       "robot.toml:6: bus.interface: bus vcan0 is given twice"},
      {bus + "[[bus.drive]]\nid = 1\nmotor = \"mf\"",
       "robot.toml:5: bus.drive.motor: no motor \"mf\""},
      {bus + "[[bus.drive]]\nid = 1\nboot_angle_deg = nan",
       "robot.toml:5: bus.drive.boot_angle_deg: nan is out of range (-360 to 360)"},
      {bus + "[[bus.drive]]\nid = 1\nquirks.clear_angle = \"no\"",
       "robot.toml:5: bus.drive.quirks.clear_angle: \"no\" is not one of ignored, implemented, "
       "sets_angle, zero"},
      {bus + "[[bus.drive]]\nid = 1\nquirks.stop_holds = 1",
       "robot.toml:5: bus.drive.quirks.stop_holds: must be true or false"},
      {bus + "[[bus.drive]]\nid = 1\nsettings.max_speed = 1",
       "robot.toml:5: bus.drive.settings.max_speed: unknown key, did you mean max_speed_dps?"},
      {bus + "[[bus.drive]]\nid = 1\nsettings.encoder_offset = 16384",
       "robot.toml:5: bus.drive.settings.encoder_offset: does not fit the encoder of this motor "
       "(14 bit on the wire)"},
      {bus + "[[bus.drive]]\nid = 1\nsettings.gains.speed_kp = 256",
       "robot.toml:5: bus.drive.settings.gains.speed_kp: 256 is out of range (0 to 255)"},
      {bus + "[[bus.drive]]\nid = 1\nrom.write_time_ms = -1",
       "robot.toml:5: bus.drive.rom.write_time_ms: -1 is out of range (0 to 10000)"},
      {bus + "[[bus.drive]]\nid = 1\nboot_angle_deg = 50\nload.theta_max_deg = 45",
       "robot.toml:6: bus.drive.load.theta_max_deg: the shaft starts beyond this end stop, at "
       "50.01 "
       "deg"},
      {bus + "[[bus.drive]]\nid = 1\nload.theta_min_deg = 1\nload.theta_max_deg = 400",
       "robot.toml:5: bus.drive.load.theta_min_deg: the drawn start may lie beyond this end stop: "
       "give boot_angle_deg"},
      {bus + "[[bus.drive]]\nid = 1\nload = 3", "robot.toml:5: bus.drive.load: must be a table"},
      {bus + "[[bus.drive]]\nid = 1\nprofile.encoder.direction = 0",
       "robot.toml:5: bus.drive.profile.encoder.direction: must be 1 or -1"},
  };
  for (const auto& [text, error] : errors) EXPECT_EQ(parse_error(text), error) << text;
}

// As Linux requires for network interfaces: 1 to 15 bytes, neither "." nor "..", no '/', ':' or
// blanks; here also no unprintable bytes.
TEST(Config, AcceptsInterfaceNamesAsLinuxDoes) {
  const auto error = [](const std::string& name) {
    return parse_error("[[bus]]\ninterface = \"" + name + "\"\ndrive = [{ id = 1 }]");
  };
  for (const char* name : {"c", "can0", "vcan-1.2_x", "...", "abcdefghijklmno", "!~"}) {
    EXPECT_EQ(error(name), "accepted") << name;
  }
  const std::string place = "robot.toml:2: bus.interface: ";
  EXPECT_EQ(error(""), place + "an interface needs a name");
  EXPECT_EQ(error("abcdefghijklmnop"),
            place + "\"abcdefghijklmnop\" is longer than an interface name can be");
  for (const std::string name : {".", "..", "can 0", "can/0", "cän0"}) {
    EXPECT_EQ(error(name), place + "\"" + name + "\" is not an interface name");
  }
  EXPECT_TRUE(error("can:0").starts_with(place + "\"can:0\": unknown kind of bus \"can:\""));
  // Unprintable bytes must not reach a terminal.
  EXPECT_EQ(error("can\\u007F0"), place + "\"can?0\" is not an interface name");
  EXPECT_EQ(error("can\\u001B0"), place + "\"can?0\" is not an interface name");
}

TEST(Config, RejectsInvalidTomlWithItsLine) {
  EXPECT_TRUE(parse_error("\nseed = = 2").starts_with("robot.toml:2: "));
  EXPECT_TRUE(parse_error("seed = 1\nseed = 2").starts_with("robot.toml:2: "));
  EXPECT_TRUE(parse_error(std::string("seed = \x00\xff", 9)).starts_with("robot.toml:1: "));
}

TEST(Overrides, CommandLineWinsOverTheFile) {
  Overrides overrides;
  overrides.motor = "mg4005";
  overrides.seed = 42;
  overrides.bitrate = 0;
  const auto buses = parse(std::string("seed = 1\nbitrate = 1000000\n") + kMinimal, overrides);
  EXPECT_EQ(buses[0].servos[0].profile.name, "mg4005");
  EXPECT_EQ(buses[0].seed, 42U);
  EXPECT_EQ(buses[0].bitrate, 0);
}

TEST(Config, ResolvesMotorPathsFromTheFile) {
  std::vector<std::string> asked;
  const auto find = [&](const std::string& motor) {
    asked.push_back(motor);
    return find_test_profile("mf7015");
  };
  const std::string text =
      "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nid = 1\nmotor = \"../my.toml\"\n";
  parse_config(text, "robots/arm/robot.toml", {}, find);
  Overrides overrides;
  overrides.motor = "../my.toml";
  parse_config(text, "robots/arm/robot.toml", overrides, find);
  EXPECT_EQ(asked, (std::vector<std::string>{"robots/arm/../my.toml", "../my.toml"}))
      << "of the command line: from where the command is given";
}

TEST(Overrides, UnknownMotorIsACommandLineError) {
  Overrides overrides;
  overrides.motor = "mf";
  EXPECT_EQ(config_error([&] { parse(kMinimal, overrides); }), "no motor \"mf\"");
}

TEST(Overrides, BusAndIdsSelectFromTheFile) {
  const std::string text = std::string(kMinimal) + "reply_time_us = 7\n";
  const auto buses = parse(text, with_bus("vcan0", std::vector{3, 4}));
  ASSERT_EQ(buses[0].servos.size(), 2U);
  EXPECT_EQ(buses[0].servos[0].reply_time, std::chrono::microseconds(7));
  EXPECT_EQ(buses[0].servos[1].id, 4);
  EXPECT_EQ(buses[0].servos[1].reply_time, ServoConfig{}.reply_time);
}

TEST(Overrides, TheOnlyBusMovesToAnotherInterface) {
  const auto buses = parse(kMinimal, with_bus("can7", std::nullopt));
  ASSERT_EQ(buses.size(), 1U);
  EXPECT_EQ(buses[0].interface, "can7");
  EXPECT_EQ(buses[0].servos[0].id, 3);
}

// A bus that runs alone keeps the boot angles and noise that it has with the others.
TEST(Overrides, ABusOfTheFileKeepsItsSeed) {
  const std::string text = R"(seed = 7
[[bus]]
interface = "vcan0"
drive = [ { id = 1 } ]
[[bus]]
interface = "vcan1"
drive = [ { id = 1 } ]
)";
  const auto all = parse(text);
  EXPECT_EQ(parse(text, with_bus("vcan0", std::nullopt))[0].seed, all[0].seed);
  EXPECT_EQ(parse(text, with_bus("vcan1", std::nullopt))[0].seed, all[1].seed);
  EXPECT_NE(parse(text, with_bus("vcan9", std::vector{1}))[0].seed, all[0].seed);
  auto seeded = with_bus("vcan1", std::nullopt);
  seeded.seed = 100;
  EXPECT_EQ(parse(text, seeded)[0].seed, 101U);
  EXPECT_EQ(parse(kMinimal, with_bus("can7", std::nullopt))[0].seed, parse(kMinimal)[0].seed);
}

TEST(Overrides, ABusNeedsDrives) {
  EXPECT_THROW(default_config(with_bus("vcan0", std::nullopt), find_test_profile),
               std::invalid_argument);
  EXPECT_THROW(default_config({}, find_test_profile), std::invalid_argument);
}

TEST(Overrides, RejectBitRateWithoutAMatchingBus) {
  const auto error = [](std::vector<std::string> buses, Overrides overrides) {
    for (const std::string& bus : buses) overrides.buses.push_back({bus, std::vector{1}});
    return config_error([&] { default_config(overrides, find_test_profile); });
  };
  Overrides baud, bitrate;
  baud.baud = 9600;
  bitrate.bitrate = 500'000;
  EXPECT_EQ(error({"vcan0", "slcan-tcp:1"}, baud), "--baud: no bus is RS-485; CAN has --bitrate");
  EXPECT_EQ(error({"rs485:/tmp/a"}, bitrate), "--bitrate: no bus is CAN; RS-485 has --baud");
  for (const Overrides& overrides : {baud, bitrate}) {
    EXPECT_EQ(error({"vcan0", "rs485:/tmp/a"}, overrides), "accepted");
  }
}

TEST(Overrides, MakeAConfigurationWithoutAFile) {
  auto overrides = with_bus("vcan0", std::vector{1, 2});
  overrides.buses.push_back({"vcan1", std::vector{1}});
  const auto buses = default_config(overrides, find_test_profile);
  ASSERT_EQ(buses.size(), 2U);
  EXPECT_EQ(buses[0].servos.size(), 2U);
  EXPECT_EQ(buses[0].servos[0].profile.name, kDefaultMotor);
  EXPECT_EQ(buses[0].seed, kDefaultSeed);
  EXPECT_NE(buses[1].seed, buses[0].seed);
}

}  // namespace config_test
}  // namespace lk::emulator
