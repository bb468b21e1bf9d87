// Inputs of a recording, with arbitrary contents.

#include "emulator/monitor/record/recording.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "emulator/core/start_error.hpp"
#include "emulator/files/profile_files.hpp"
#include "emulator/monitor/record/replay.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::emulator {
namespace recording_test {

const std::string kMotors = LKEMU_SOURCE_DIR "/configs/motors/";

std::string input(const std::string& directive) {
  return R"({"time_ns":5,"after_frames":2,"bus":"vcan0","directive":)" + directive + "}";
}

/// Returns the line of a ROM whose first parameter was written `writes` times.
std::string rom(const std::string& writes) {
  return R"({"time_ns":0,"after_frames":0,"bus":"vcan0","restored_rom":{"id":1,"rom":"","wear":[)" +
         writes + ",0,0,0,0,0,0,0,0,0]}}";
}

TEST(RecordedInput, RoundTrips) {
  const std::string line = input(R"({"id":1,"when":{"signal":"iq_A","above":2},"power":"off"})");
  EXPECT_EQ(print_input(parse_input(line, "x", 1)), line);
  const auto most = parse_input(rom("4294967295"), "x", 1);
  EXPECT_EQ(std::get<RecordedInput::RestoredRom>(most.what).wear[0], 4294967295U);
}

TEST(RecordedInput, RestoresIdAndBusSettingsOfRom) {
  ServoConfig servo;
  servo.id = 3;
  servo.profile.name = "test";
  servo.rom.driver_id = 9;  // initial values
  servo.rom.bus_type = 1;
  servo.rom.serial_rate = 5;
  servo.rom.can_rate = 2;
  const Registers wired{};
  EXPECT_EQ(restored_rom(record_rom(wired, {}, "vcan0", servo), "vcan0", servo), wired);
  Registers moved{};
  moved.can_rate = 3;
  EXPECT_EQ(restored_rom(record_rom(moved, {}, "vcan0", servo), "vcan0", servo), moved);
}

TEST(RecordedInput, RejectsMalformedLines) {
  const std::string deep(500'000, '[');
  for (const std::string& line :
       {std::string("{"), std::string("7"), input(R"({"id":1,"id":2})"),
        input(deep + std::string(deep.size(), ']')), std::string(R"({"time_ns":"soon"})"),
        std::string(R"({"time_ns":1e300,"after_frames":0,"bus":"vcan0","end":true})"),
        std::string(R"({"time_ns":0,"after_frames":-1,"bus":"vcan0","end":true})"),
        rom("4294967296"), rom("-1"), rom("1.8e110"), rom("true")}) {
    try {
      parse_input(line, "directives.jsonl", 7);
      ADD_FAILURE() << line.substr(0, 80);
    } catch (const ConfigError& problem) {
      EXPECT_EQ(std::string(problem.what()).rfind("directives.jsonl:7: ", 0), 0U) << problem.what();
    }
  }
}

/// The next start would refuse a directory with an incomplete beginning.
TEST(Recording, FailedStartLeavesNoFiles) {
  const test::TempDirectory scratch;
  const std::filesystem::path directory = scratch.path() / "recording";
  ConfigTexts texts{"a configuration",
                    "robot.toml",
                    {{"a", {"a", "a.toml", "a motor"}},
                     {"none/such", {"none/such", "none/such.toml", "in no directory"}}}};
  EXPECT_THROW(begin_recording(directory, {}, texts, {}), StartError);
  EXPECT_FALSE(std::filesystem::exists(directory));
  std::filesystem::create_directory(directory);
  EXPECT_THROW(begin_recording(directory, {}, texts, {}), StartError);
  EXPECT_TRUE(std::filesystem::is_empty(directory)) << "what was there before stays";
  texts.motors.erase("none/such");
  begin_recording(directory, {}, texts, {});
  EXPECT_TRUE(std::filesystem::exists(directory / kRecordingFile));
  EXPECT_THROW(begin_recording(directory, {}, texts, {}), StartError);
  EXPECT_TRUE(std::filesystem::exists(directory / kRecordingFile)) << "somebody's recording";
}

/// A recording includes all motor files, also extended ones, under any name.
TEST(Recording, ReplaysWithoutTheOriginalMotorFiles) {
  const test::TempDirectory scratch;
  const std::filesystem::path directory = scratch.path() / "recording";
  std::filesystem::create_directories(scratch.path() / "left");
  scratch.put("my.toml", "extends = \"left/my.toml\"\nmotor.R_s_ohm = 0.5\n");
  scratch.put("left/my.toml", "extends = \"" + kMotors + "mf7015.toml\"\nmotor.R_s_ohm = 0.25\n");
  ConfigTexts texts;
  texts.config = R"([[bus]]
interface = "vcan0"
[[bus.drive]]
id = 1
motor = "./my.toml"
[[bus.drive]]
id = 2
motor = "./left/my.toml"
[[bus.drive]]
id = 3
motor = ")" + kMotors +
                 "mf7015.toml\"\n";
  texts.config_file = scratch.path("robot.toml");
  const auto buses =
      parse_config(*texts.config, texts.config_file, {}, profile_finder(texts.motors));
  begin_recording(directory, {}, texts, buses);
  for (const char* gone : {"my.toml", "left/my.toml"}) {
    std::filesystem::remove(scratch.path() / gone);
  }
  const auto copies = std::filesystem::directory_iterator(directory / "motors");
  EXPECT_EQ(std::distance(begin(copies), end(copies)), 3) << "my.toml, my-2.toml and mf7015.toml";
  const Recording recording = read_recording(directory);
  const auto& servos = recording.buses.at(0).servos;
  ASSERT_EQ(servos.size(), 3U);
  EXPECT_DOUBLE_EQ(servos[0].profile.drive.motor.R_s, 0.5);
  EXPECT_DOUBLE_EQ(servos[1].profile.drive.motor.R_s, 0.25);
  EXPECT_EQ(servos[1].profile.name, "my.toml");
  EXPECT_EQ(servos[2].profile.name, "mf7015.toml");
}

/// A recording from a third party may contain anything.
TEST(Recording, RejectsFilesThatAreNotRegular) {
  const test::TempDirectory scratch;
  const std::filesystem::path directory = scratch.path() / "recording";
  ConfigTexts texts;
  texts.config = "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nid = 1\nmotor = \"" + kMotors +
                 "mf7015.toml\"\n";
  auto buses = parse_config(*texts.config, "robot.toml", {}, profile_finder(texts.motors));
  buses[0].servos[0].wear.fill(1);
  begin_recording(directory, {}, texts, buses);
  const auto replayed = [&] {
    const Recording recording = read_recording(directory);
    Replay replay(recording.buses);
    replay_recording(directory, recording, replay, nullptr);
  };
  EXPECT_NO_THROW(replayed());
  for (const char* name : {"recording.json", "config.toml", "motors/mf7015.toml",
                           "rom/vcan0-1.toml", kInputsFile, kFramesFile}) {
    const std::filesystem::path file = directory / name;
    std::filesystem::rename(file, scratch.path("kept"));
    ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0) << name;
    try {
      replayed();
      ADD_FAILURE() << name;
    } catch (const StartError& problem) {
      EXPECT_EQ(problem.what(), file.string() + ": is not a regular file");
    }
    std::filesystem::rename(scratch.path("kept"), file);
  }
}

TEST(Recording, ErrorsNameTheCopiedFile) {
  const test::TempDirectory scratch;
  const std::filesystem::path directory = scratch.path() / "recording";
  scratch.put("my.toml", "extends = \"" + kMotors + "mf7015.toml\"\n");
  ConfigTexts texts;
  texts.config = "[[bus]]\ninterface = \"a\"\n[[bus.drive]]\nid = 1\nmotor = \"./my.toml\"\n";
  texts.config_file = scratch.path("robot.toml");
  begin_recording(directory, {}, texts,
                  parse_config(*texts.config, texts.config_file, {}, profile_finder(texts.motors)));
  const auto problem_with = [&](const char* file, const char* text) {
    std::ofstream(directory / file) << text;
    try {
      read_recording(directory);
    } catch (const StartError& problem) {
      return std::string(problem.what());
    }
    return std::string();
  };
  EXPECT_EQ(problem_with("motors/my.toml", "extends = \"mg4005\"\n")
                .find((directory / "motors/my.toml").string() + ":1: extends: "),
            0U);
  EXPECT_EQ(problem_with("config.toml", "[[bus]]\n"),
            (directory / "config.toml").string() + ":1: bus.interface: missing");
}

/// They determine the meaning of the recorded bytes.
TEST(Recording, KeepsFirmwareAndBootAngleOfTheCommandLine) {
  const test::TempDirectory scratch;
  RecordingInfo info;
  info.overrides.motor = kMotors + "mg4010.toml";
  info.overrides.boot_angle_deg = -12.5;
  info.overrides.firmware = {"seen", {{"stop_holds", "true"}}};
  info.overrides.buses.push_back({"vcan0", std::vector{1}});
  info.overrides.buses.push_back({"vcan1", std::vector{1}, {"v236", {{"reply_id_base", "0x180"}}}});
  ConfigTexts texts;
  profile_finder(texts.motors)(*info.overrides.motor);
  begin_recording(scratch.path() / "recording", info, texts, {});
  const Recording read = read_recording(scratch.path() / "recording");
  ASSERT_EQ(read.buses.size(), 2U);
  EXPECT_EQ(read.buses[0].servos[0].boot_angle_deg, -12.5);
  EXPECT_EQ(read.buses[0].servos[0].generation, Generation::kLateLegacy);
  EXPECT_TRUE(read.buses[0].servos[0].quirks.stop_holds);
  EXPECT_EQ(read.buses[1].servos[0].generation, Generation::kV236);
  EXPECT_TRUE(read.buses[1].servos[0].quirks.stop_holds);
  EXPECT_EQ(read.buses[1].servos[0].quirks.dialect.reply_id_base, 0x180U);
}

}  // namespace recording_test
}  // namespace lk::emulator
