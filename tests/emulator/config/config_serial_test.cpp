// RS-485 buses in configuration files and on the command line (docs/reference/rs485.md).

#include "emulator/config/config_serial.hpp"

#include <gtest/gtest.h>

#include "emulator/core/generation.hpp"
#include "emulator/core/servo/stored_settings.hpp"
#include "tests/emulator/config/config_support.hpp"

namespace lk::emulator {
namespace config_serial_test {

using namespace std::chrono_literals;
using protocol::Framing;

const std::string kBus = "[[bus]]\ninterface = \"rs485:/tmp/arm\"\n";
const std::string kDrive = "[[bus.drive]]\nid = 1\n";

/// Returns the error message for a refused file, without its location.
std::string reason(const std::string& text) {
  try {
    parse(text);
  } catch (const ConfigError& problem) {
    return problem.key + ": " + problem.reason;
  }
  return "accepted";
}

TEST(ConfigSerial, BusNameSelectsRs485) {
  const auto buses = parse(kBus + kDrive + "[[bus]]\ninterface = \"vcan0\"\n" + kDrive);
  ASSERT_EQ(buses.size(), 2U);
  EXPECT_EQ(buses[0].serial, SerialConfig{});
  EXPECT_EQ(buses[0].bitrate, 115'200);
  EXPECT_EQ(buses[0].servos[0].quirks, quirks_of(Generation::kLegacy, Framing::kSerial));
  EXPECT_EQ(buses[0].servos[0].reply_time, 150us);
  EXPECT_EQ(buses[0].servos[0].reply_spread, 50us);
  EXPECT_EQ(buses[0].servos[0].rate_code, 4);
  EXPECT_FALSE(buses[1].serial);
  EXPECT_EQ(buses[1].bitrate, 1'000'000);
  EXPECT_EQ(buses[1].servos[0].quirks, quirks_of(Generation::kLegacy));
  EXPECT_EQ(buses[1].servos[0].reply_time, 100us);
}

TEST(ConfigSerial, CommandLineSelectsRs485) {
  Overrides overrides;
  overrides.buses = {{"rs485:/tmp/arm", std::vector{1, 2}}, {"vcan0", std::vector{1}}};
  overrides.baud = 2'000'000;
  overrides.firmware.generation = "v236";
  const auto buses = default_config(overrides, find_test_profile);
  ASSERT_EQ(buses.size(), 2U);
  EXPECT_EQ(buses[0].serial, SerialConfig{});
  EXPECT_EQ(buses[0].bitrate, 2'000'000);
  EXPECT_EQ(buses[0].servos[1].quirks, quirks_of(Generation::kV236, Framing::kSerial));
  EXPECT_EQ(buses[0].servos[1].rate_code, 9);
  EXPECT_EQ(buses[1].bitrate, 1'000'000);
  EXPECT_EQ(buses[1].servos[0].quirks, quirks_of(Generation::kV236));
}

TEST(ConfigSerial, UntimedBusAcceptsAnyDriveRate) {
  Overrides overrides;
  overrides.buses = {{"rs485:/tmp/arm", std::vector{1}}, {"vcan0", std::vector{1}}};
  overrides.baud = overrides.bitrate = 0;
  for (BusConfig& bus : default_config(overrides, find_test_profile)) {
    ServoConfig& servo = bus.servos[0];
    const DriveAddress delivered = drive_address(servo.rom, servo);
    EXPECT_EQ(serial_rate_of(delivered.serial_rate, true), 115'200) << bus.interface;
    EXPECT_EQ(can_rate_of(delivered.can_rate), 1'000'000) << bus.interface;
    EXPECT_TRUE(is_at_its_rate(delivered, servo)) << bus.interface;
    servo.rom.serial_rate = 7;
    servo.rom.can_rate = 3;
    EXPECT_TRUE(is_at_its_rate(drive_address(servo.rom, servo), servo)) << bus.interface;
  }
}

TEST(ConfigSerial, DrivesStartAtTheBusRateOfTheCommandLine) {
  Overrides overrides;
  overrides.buses = {{"vcan0", std::vector{1}}};
  overrides.bitrate = 500'000;
  for (const auto& buses : {default_config(overrides, find_test_profile),
                            parse_config("[[bus]]\ninterface = \"vcan0\"\n" + kDrive, "robot.toml",
                                         overrides, find_test_profile)}) {
    const ServoConfig& servo = buses.at(0).servos[0];
    EXPECT_EQ(buses[0].bitrate, 500'000);
    EXPECT_EQ(can_rate_of(drive_address(servo.rom, servo).can_rate), 500'000);
  }
}

TEST(ConfigSerial, EveryKeyIsRead) {
  const auto bus = parse(kBus + R"([bus.rs485]
reply_us = 200
reply_spread_us = 10
gap_ms = 2.5
resync = "idle"
max_len = 60
broadcast_gap_bits = 30
broadcast_reply_us = 12.5
pty_termios = "raw"
pty_rate = "ignore"
baud_codes = 10
hears_while_replying = false
)" + kDrive)[0];
  SerialConfig wanted;
  wanted.reply_time = 200us;
  wanted.reply_spread = 10us;
  wanted.gap = 2500us;
  wanted.scan = false;
  wanted.max_len = 60;
  wanted.broadcast_gap_bits = 30;
  wanted.broadcast_reply_time = 12'500ns;
  wanted.as_tty = false;
  wanted.enforces_rate = false;
  wanted.has_921600 = false;
  wanted.receives_while_replying = false;
  EXPECT_EQ(bus.serial, wanted);
  EXPECT_EQ(bus.servos[0].reply_time, 200us);
  EXPECT_EQ(bus.servos[0].reply_spread, 10us);
  // A reply time of the drive itself has no spread.
  const auto own = parse(kBus + kDrive + "reply_time_us = 70\n")[0].servos[0];
  EXPECT_EQ(own.reply_time, 70us);
  EXPECT_EQ(own.reply_spread, 0us);
}

TEST(ConfigSerial, SwitchesApplyToTheRs485Dialect) {
  const auto drive = parse(kBus + kDrive + R"(generation = "v235"
quirks = { setting_commands = false, zero_ram_len = 7, wrong_len = "lax", product_info_bytes = 0 }
)")[0]
                         .servos[0];
  protocol::Dialect wanted = protocol::kM35Dialect;
  wanted.setting_commands = false;
  wanted.zero_ram_len = 7;
  wanted.lax_length = true;
  wanted.product_info_bytes = 0;
  EXPECT_EQ(drive.quirks.dialect, wanted);
  EXPECT_EQ(reason("[[bus]]\ninterface = \"vcan0\"\n" + kDrive + "quirks.zero_ram_len = 7\n"),
            "bus.drive.quirks.zero_ram_len: unknown key");
  EXPECT_EQ(reason(kBus + kDrive + "quirks.reply_id_base = 0x180\n"),
            "bus.drive.quirks.reply_id_base: belongs to CAN");
  EXPECT_EQ(reason(kBus + kDrive + "quirks.product_info_bytes = 43\n"),
            "bus.drive.quirks.product_info_bytes: must be 0, 42 or 58");
}

TEST(ConfigSerial, RejectsInvalidValues) {
  EXPECT_NE(
      reason(kBus + "bitrate = 500_000\n" + kDrive).find("500000 is not a bit rate of RS-485"),
      std::string::npos);
  EXPECT_NE(reason(kBus + "bitrate = 921_600\n" + kDrive).find("is not a bit rate of RS-485"),
            std::string::npos);
  EXPECT_EQ(reason(kBus + "bitrate = 0\n" + kDrive), "accepted");
  EXPECT_EQ(reason("bitrate = 500_000\n" + kBus + kDrive),
            "bitrate: has no effect: no bus is CAN, and those of RS-485 have their own");
  for (const std::string key : {"pty_termios = \"raw\"", "pty_rate = \"ignore\""}) {
    EXPECT_NE(reason("[[bus]]\ninterface = \"rs485-tcp:1\"\n[bus.rs485]\n" + key + "\n" + kDrive)
                  .find("has no effect on rs485-tcp, which has no terminal: remove it"),
              std::string::npos)
        << key;
  }
  EXPECT_NE(reason(kBus + "bitrate = 460_800\n" + kDrive + "settings.broadcast_mode = true\n")
                .find("needs 1, 2 or 4 Mbit/s on RS-485"),
            std::string::npos);
  EXPECT_EQ(reason(kBus + "bitrate = 1_000_000\n" + kDrive + "settings.broadcast_mode = true\n"),
            "accepted");
  EXPECT_NE(reason(kBus + "rs485.reply_us = 20\n" + kDrive).find("the spread must not be above"),
            std::string::npos);
  EXPECT_NE(interface_name_problem("rs485:"), "");
  EXPECT_NE(interface_name_problem("rs485:/tmp/a b"), "");
  EXPECT_NE(interface_name_problem("rs485:/" + std::string(90, 'x')), "");
  EXPECT_EQ(interface_name_problem("rs485:/dev/ttyUSB0"), "");
}

TEST(ConfigSerial, RateCodesMatchTheVendorTools) {
  EXPECT_EQ(rate_code(9600, true), 0);
  EXPECT_EQ(rate_code(460'800, true), 6);
  EXPECT_EQ(rate_code(1'000'000, true), 8);
  EXPECT_EQ(rate_code(4'000'000, true), 10);
  EXPECT_EQ(rate_code(1'000'000, false), 7);
  EXPECT_EQ(rate_code(460'800, false), 6);
  EXPECT_EQ(serial_rate_of(7, true), 921'600);
  EXPECT_EQ(serial_rate_of(10, true), 4'000'000);
  EXPECT_EQ(serial_rate_of(11, true), 0);
  EXPECT_EQ(serial_rate_of(6, false), 460'800);
  EXPECT_EQ(serial_rate_of(7, false), 1'000'000);
  EXPECT_EQ(serial_rate_of(9, false), 4'000'000);
  EXPECT_EQ(serial_rate_of(10, false), 0);
}

}  // namespace config_serial_test
}  // namespace lk::emulator
