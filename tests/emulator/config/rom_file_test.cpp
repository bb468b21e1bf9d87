#include "emulator/config/rom_file.hpp"

#include <gtest/gtest.h>

#include <map>

#include "tests/emulator/config/config_support.hpp"

namespace lk::emulator {
namespace rom_file_test {

ServoConfig drive() {
  ServoConfig servo;
  servo.id = 3;
  servo.profile.name = "mf7015";
  servo.profile.drive.encoder.bits = 18;
  return servo;
}

/// All parameters differ from their defaults; none is round.
Registers odd_registers() {
  Registers rom;
  rom.gains = {65535, 0, 1, 255, 256, 77, 9, 10, 11};
  rom.acceleration_dps_s = 2147483647;
  rom.encoder_offset = 54321;
  rom.max_torque_current_lsb = 1999;
  rom.max_power_permille = 123;
  rom.max_speed_dps = 16800.1;
  rom.max_angle_deg = 1.0 / 3;
  rom.current_ramp_A_s = 1e-300;
  rom.broadcast_mode = true;
  for (std::size_t kind = 0; kind < rom.protections.size(); ++kind) {
    const auto k = static_cast<double>(kind);
    rom.protections[kind] = {kind % 2 == 0, 50 + k / 7, 0.1 + k / 10, k / 3, kind % 3 == 0};
  }
  rom.align_value = 65535;
  rom.driver_id = 32;
  rom.bus_type = 2;
  rom.serial_rate = 10;
  rom.can_rate = 0;
  return rom;
}

constexpr RomWear kEach = {1, 22, 333, 4444, 5, 6, 7, 8, 9, 4294967295, 11, 12, 13, 14, 15};

std::string error_of(const std::string& text) {
  return config_error([&] {
    ServoConfig servo = drive();
    read_rom(text, "rom.toml", "vcan0", servo);
  });
}

TEST(RomFile, RoundTripsEveryParameter) {
  const Registers rom = odd_registers();
  ServoConfig servo = drive();
  read_rom(print_rom({"vcan0", 3, "mf7015"}, rom, kEach), "rom.toml", "vcan0", servo);
  EXPECT_EQ(servo.wear, kEach);
  EXPECT_EQ(servo.rom, rom);
  EXPECT_EQ(servo.rom.max_power_permille, rom.max_power_permille);
  for (std::size_t kind = 0; kind < rom.protections.size(); ++kind) {
    EXPECT_EQ(servo.rom.protections[kind].recoverable, rom.protections[kind].recoverable) << kind;
  }
  EXPECT_EQ(print_rom({"vcan0", 3, "mf7015"}, servo.rom, servo.wear),
            print_rom({"vcan0", 3, "mf7015"}, rom, kEach));
}

TEST(RomFile, OmitsIdAndBusSettings) {
  const std::string text = print_rom({"vcan0", 3, "mf7015"}, drive().rom, kEach);
  for (const char* key : {"driver_id", "bus_type", "rs485_rate", "can_rate"}) {
    EXPECT_EQ(text.find(key), std::string::npos) << key;
  }
}

TEST(RomFile, KeepsConfiguredValuesOfUnwrittenParameters) {
  for (std::size_t p = 0; p < kRomParameters; ++p) {
    RomWear wear{};
    wear[p] = 5;
    const std::string text = print_rom({"vcan0", 3, "mf7015"}, odd_registers(), wear);
    ServoConfig servo = drive();
    read_rom(text, "rom.toml", "vcan0", servo);
    EXPECT_EQ(servo.wear, wear) << text;
    // Parameters missing in the file keep their configured values. Drives with and without such a
    // parameter in the file are otherwise equal.
    EXPECT_EQ(print_rom({"vcan0", 3, "mf7015"}, servo.rom, wear), text);
    RomWear others = kEach;
    others[p] = 0;
    EXPECT_EQ(print_rom({"vcan0", 3, "mf7015"}, servo.rom, others),
              print_rom({"vcan0", 3, "mf7015"}, drive().rom, others))
        << text;
  }
}

TEST(RomFile, IsReadable) {
  RomWear wear{};
  wear[static_cast<std::size_t>(RomParameter::kEncoderOffset)] = 2;
  Registers rom;
  rom.encoder_offset = 8192;
  EXPECT_EQ(print_rom({"vcan0", 3, "mf7015"}, rom, wear),
            R"(# ROM of a virtual drive, kept by lk-emu: what was written to it, and how often.
# All else is as configured.
format = 1
bus = "vcan0"
id = 3
motor = "mf7015"

[settings]
encoder_offset = 8192

[writes]
encoder_offset = 2
)");
}

TEST(RomFile, EscapesInterfaceNames) {
  ServoConfig servo = drive();
  const std::string bus = "a\"\\'#";
  read_rom(print_rom({bus, 3, "mf7015"}, odd_registers(), kEach), "rom.toml", bus, servo);
  EXPECT_EQ(servo.wear, kEach);
}

TEST(RomFile, RejectsTruncation) {
  const std::string text = print_rom({"vcan0", 3, "mf7015"}, odd_registers(), kEach);
  for (std::size_t size = 0; size < text.size(); ++size) {
    ServoConfig servo = drive();
    EXPECT_THROW(read_rom(text.substr(0, size), "rom.toml", "vcan0", servo), ConfigError) << size;
    EXPECT_EQ(servo.wear, RomWear{}) << "what is refused leaves nothing behind";
    EXPECT_EQ(servo.rom, drive().rom);
  }
}

TEST(RomFile, RejectsMissingLines) {
  const std::string text = print_rom({"vcan0", 3, "mf7015"}, odd_registers(), kEach);
  for (std::size_t start = 0, end = 0; start < text.size(); start = end) {
    end = text.find('\n', start) + 1;
    const std::string line = text.substr(start, end - start);
    if (line == "\n" || line[0] == '#') continue;
    EXPECT_NE(error_of(text.substr(0, start) + text.substr(end)), "accepted") << line;
  }
}

TEST(RomFile, ErrorsNameFileLineKeyAndReason) {
  const std::string head = "format = 1\nbus = \"vcan0\"\nid = 3\nmotor = \"mf7015\"\n";
  const std::map<std::string, std::string> errors = {
      {"", "rom.toml:1: the file is cut off here"},
      {"\n", "rom.toml:1: format: missing"},
      {"format = 2\nwhatever = 1\n",
       "rom.toml:1: format: 2 is not known to this version of lk-emu, 1 is"},
      {"format = \"1\"\n", "rom.toml:1: format: must be a whole number"},
      {"format = 1\nbus = \"vcan1\"\nid = 3\nmotor = \"mf7015\"\n",
       "rom.toml:2: bus: this is the ROM of vcan1:3, motor mf7015, not of vcan0:3, motor mf7015"},
      {"format = 1\nbus = \"vcan0\"\nid = 4\nmotor = \"mf7015\"\n",
       "rom.toml:3: id: this is the ROM of vcan0:4, motor mf7015, not of vcan0:3, motor mf7015"},
      {"format = 1\nbus = \"vcan0\"\nid = 3\nmotor = \"mg4005\"\n",
       "rom.toml:4: motor: this is the ROM of vcan0:3, motor mg4005, not of vcan0:3, motor mf7015"},
      {head, "rom.toml:1: writes: missing"},
      {head + "[writes]\n", "rom.toml:1: settings: missing"},
      {head + "[settings]\n[writes]\n", "accepted"},
      {head + "[settings]\nmax_angle_deg = 1\n[writes]\n",
       "rom.toml:6: settings.max_angle_deg: [writes] has no count of it"},
      {head + "[settings]\n[writes]\nmax_angle_deg = 1\n",
       "rom.toml:5: settings.max_angle_deg: missing, though [writes] counts it"},
      {head + "[settings]\nmax_angle = 1\n[writes]\n",
       "rom.toml:6: settings.max_angle: unknown key"},
      {head + "[settings]\nmax_speed_dps = 0\n[writes]\nmax_speed_dps = 1\n",
       "rom.toml:6: settings.max_speed_dps: 0 is out of range (1 to 72000)"},
      {head + "[settings]\ngains = { angle_kp = 1 }\n[writes]\ngains = 1\n",
       "rom.toml:6: settings.gains.angle_ki: missing"},
      {head + "[settings]\ngains = 1\n[writes]\ngains = 1\n",
       "rom.toml:6: settings.gains: must be a table"},
      {head + "[settings]\nprotection = 1\n[writes]\nprotection = 1\n",
       "rom.toml:6: settings.protection: must be a table"},
      {head + "[settings]\nbroadcast_mode = 1\n[writes]\nbroadcast_mode = 1\n",
       "rom.toml:6: settings.broadcast_mode: must be true or false"},
      {head + "[settings]\nbroadcast_mode = true\n[writes]\nbroadcast_mode = 0\n",
       "rom.toml:8: writes.broadcast_mode: 0 is out of range (1 to 4294967295)"},
      {head + "[settings]\n[writes]\n[other]\n", "rom.toml:7: other: unknown key"},
      {head + "[settings]\nencoder_offset = 65536\n[writes]\nencoder_offset = 1\n",
       "rom.toml:6: settings.encoder_offset: 65536 is out of range (0 to 65535)"},
  };
  for (const auto& [text, error] : errors) EXPECT_EQ(error_of(text), error) << text;
}

TEST(RomFile, ZeroChangeKeepsTheShaftAngle) {
  ServoConfig servo = drive();
  servo.rom.encoder_offset = 100;
  read_rom(print_rom({"vcan0", 3, "mf7015"}, odd_registers(), kEach), "rom.toml", "vcan0", servo);
  EXPECT_EQ(servo.rom.encoder_offset, odd_registers().encoder_offset);
  EXPECT_EQ(servo.boot_offset, 100) << "the boot angle counts from the zero of the configuration";
}

TEST(RomFile, RejectsOffsetBeyondTheEncoder) {
  ServoConfig servo = drive();
  servo.profile.drive.encoder.bits = 14;
  const std::string text =
      "format = 1\nbus = \"vcan0\"\nid = 3\nmotor = \"mf7015\"\n"
      "[settings]\nencoder_offset = 16384\n[writes]\nencoder_offset = 1\n";
  EXPECT_EQ(
      config_error([&] { read_rom(text, "rom.toml", "vcan0", servo); }),
      "rom.toml:6: settings.encoder_offset: does not fit the encoder of this motor (14 bit on "
      "the wire)");
}

TEST(RomFile, RejectsNoise) {
  EXPECT_TRUE(error_of(std::string(4096, '\0')).starts_with("rom.toml:1: "));
  EXPECT_TRUE(error_of("\x7f"
                       "ELF\x01\n")
                  .starts_with("rom.toml:1: "));
  EXPECT_TRUE(error_of("format = 1\nformat = 1\n").starts_with("rom.toml:2: "));
}

}  // namespace rom_file_test
}  // namespace lk::emulator
