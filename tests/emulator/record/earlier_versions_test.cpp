// What people have of earlier versions goes on loading: robots, motors, scenarios, ROM and
// recordings, as version 0.1.0 delivered and wrote them.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/profile.hpp"
#include "emulator/config/rom_file.hpp"
#include "emulator/config/scenario/scenario_file.hpp"
#include "emulator/record/recording.hpp"
#include "emulator/record/replay_directory.hpp"
#include "emulator/record/replay_text.hpp"
#include "tests/support/profile.hpp"

namespace lk::emulator {
namespace earlier_versions_test {

namespace fs = std::filesystem;

const fs::path kEarlier = LKEMU_SOURCE_DIR "/tests/emulator/fixtures/0.1.0";

std::string text_of(const fs::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::vector<fs::path> files_of(const char* folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(kEarlier / folder)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

MotorFile motor_of_then(const std::string& name) {
  const fs::path file = kEarlier / "motors" / (name + ".toml");
  return {name, file.string(), text_of(file)};
}

Profile profile_of_then(const std::string& name) {
  return parse_profile(motor_of_then(name), motor_of_then);
}

TEST(EarlierVersions, MotorFilesLoad) {
  const auto files = files_of("motors");
  EXPECT_EQ(files.size(), 18U);
  for (const fs::path& file : files) {
    const std::string name = file.stem().string();
    EXPECT_NO_THROW(profile_of_then(name)) << name;
  }
}

/// With the motors of today, by their names, and with copies of those of then.
TEST(EarlierVersions, RobotsLoad) {
  const auto files = files_of("buses");
  EXPECT_EQ(files.size(), 6U);
  for (const fs::path& file : files) {
    for (const FindProfile& find : {FindProfile(test::profile), FindProfile(profile_of_then)}) {
      EXPECT_NO_THROW(parse_config(text_of(file), file.string(), {}, find)) << file;
    }
  }
}

TEST(EarlierVersions, ScenariosLoad) {
  const fs::path folder = kEarlier / "scenarios";
  const auto robot = [&folder](const std::string& name, const Overrides& overrides) {
    const bool path = name.ends_with(".toml");
    const fs::path file = path ? folder / name : kEarlier / "buses" / (name + ".toml");
    return parse_config(text_of(file), file.string(), overrides, test::profile);
  };
  const auto log = [&folder](const std::string& name) { return text_of(folder / name); };
  const auto files = files_of("scenarios");
  EXPECT_EQ(files.size(), 24U);
  for (const fs::path& file : files) {
    EXPECT_NO_THROW(parse_scenario(text_of(file), file.string(), {}, {robot, log})) << file;
  }
}

/// Written by drives that were told 0x32, where they have it, and 0x19.
TEST(EarlierVersions, RomLoads) {
  const auto buses =
      parse_config(text_of(kEarlier / "rom" / "robot.toml"), "robot.toml", {}, test::profile);
  for (const ServoConfig& configured : buses.at(0).servos) {
    ServoConfig servo = configured;
    const fs::path file = kEarlier / "rom" / rom_file_name(buses[0].interface, servo.id);
    ASSERT_NO_THROW(read_rom(text_of(file), file.string(), buses[0].interface, servo)) << file;
    EXPECT_NE(servo.rom.encoder_offset, configured.rom.encoder_offset) << file;
    const bool told = servo.quirks.dialect.pid_commands;
    EXPECT_EQ(servo.rom.gains.speed_kp, told ? 33 : configured.rom.gains.speed_kp) << file;
  }
}

/// Its replies are those of another model, and that is what is said first.
TEST(EarlierVersions, ARecordingSaysThatTheModelDiffers) {
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
