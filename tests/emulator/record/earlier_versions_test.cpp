// Files of version 0.1.0 load: a robot, motors, a scenario, ROM and a recording.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/profile.hpp"
#include "emulator/config/rom_file.hpp"
#include "emulator/config/scenario/scenario_file.hpp"
#include "emulator/files/output_file.hpp"
#include "emulator/monitor/record/recording.hpp"
#include "emulator/monitor/record/replay.hpp"
#include "tests/support/profile.hpp"

namespace lk::emulator {
namespace earlier_versions_test {

namespace fs = std::filesystem;

const fs::path kEarlier = LKEMU_SOURCE_DIR "/tests/emulator/fixtures/0.1.0";

std::string text_of(const fs::path& file) { return read_regular_file(file, kLongestLog); }

MotorFile motor_of_then(const std::string& name) {
  const fs::path file = kEarlier / "recording/motors" / (name + ".toml");
  return {name, file.string(), text_of(file)};
}

Profile profile_of_then(const std::string& name) {
  return parse_profile(motor_of_then(name), motor_of_then);
}

TEST(EarlierVersions, MotorFilesLoad) {
  for (const char* name : {"mf7015", "mg4005", "ms4015"}) {
    EXPECT_NO_THROW(profile_of_then(name)) << name;
  }
}

std::vector<BusConfig> robot_of_then(const fs::path& file, const FindProfile& find,
                                     const Overrides& overrides = {}) {
  return parse_config(text_of(kEarlier / file), file.string(), overrides, find);
}

/// The example has nearly every key; the other robot also loads with copies of its former motor
/// files.
TEST(EarlierVersions, RobotsLoad) {
  EXPECT_NO_THROW(robot_of_then("buses/example.toml", test::profile));
  EXPECT_NO_THROW(robot_of_then("recording/config.toml", test::profile));
  EXPECT_NO_THROW(robot_of_then("recording/config.toml", profile_of_then));
}

TEST(EarlierVersions, ScenariosLoad) {
  const auto robot = [](const std::string& name, const Overrides& overrides) {
    return robot_of_then("scenarios/" + name, test::profile, overrides);
  };
  const auto log = [](const std::string& name) { return text_of(kEarlier / "scenarios" / name); };
  const fs::path file = kEarlier / "scenarios/brown_out_in_mid_move.toml";
  EXPECT_NO_THROW(parse_scenario(text_of(file), file.string(), {}, {robot, log}));
}

/// Written by drives that received 0x19 and, if they have it, 0x32.
TEST(EarlierVersions, RomLoads) {
  const BusConfig bus = robot_of_then("recording/config.toml", test::profile).at(0);
  for (const int id : {1, 3}) {
    const auto configured = std::ranges::find(bus.servos, id, &ServoConfig::id);
    ASSERT_NE(configured, bus.servos.end());
    ServoConfig servo = *configured;
    const fs::path file = kEarlier / "rom" / rom_file_name(bus.interface, servo.id);
    ASSERT_NO_THROW(read_rom(text_of(file), file.string(), bus.interface, servo)) << file;
    EXPECT_NE(servo.rom.encoder_offset, configured->rom.encoder_offset) << file;
    const bool told = servo.quirks.dialect.pid_commands;
    EXPECT_EQ(told, id == 3);
    EXPECT_EQ(servo.rom.gains.speed_kp, told ? 33 : configured->rom.gains.speed_kp) << file;
  }
}

/// Its replies come from another model version, which the replay reports first.
TEST(EarlierVersions, ReplayReportsAnotherModel) {
  const Recording recording = read_recording(kEarlier / "recording");
  EXPECT_EQ(recording.info.version, "0.1.0");
  Replay replay(recording.buses);
  replay_recording(kEarlier / "recording", recording, replay);
  ASSERT_TRUE(replay.difference());
  const std::string text =
      difference_text(*replay.difference(), recording.buses.front(), recording.info);
  EXPECT_TRUE(text.starts_with("made by 0.1.0, the model differs: this is " LKEMU_VERSION "\n"
                               "first difference on "))
      << text;
  EXPECT_GT(replay.equal_replies(), 0U) << "what does not depend on the model is the same";
}

}  // namespace earlier_versions_test
}  // namespace lk::emulator
