#include "emulator/files/profile_files.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <stdexcept>
#include <string>

#include "emulator/core/coupling/mechanism.hpp"
#include "emulator/files/output_file.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::emulator {
namespace profile_files_test {

std::string refusal(const std::string& file, std::uintmax_t longest) {
  try {
    read_regular_file(file, longest);
  } catch (const std::invalid_argument& problem) {
    return problem.what();
  }
  return "";
}

TEST(RegularFile, IsReadUpToItsLimit) {
  const test::TempDirectory directory;
  const std::string text(100'000, 'x');
  const std::string file = directory.put("a.toml", text);
  EXPECT_EQ(read_regular_file(file, text.size()), text);
  EXPECT_EQ(refusal(file, text.size() - 1), file + ": is longer than 99999 bytes");
  EXPECT_EQ(read_regular_file(directory.put("empty", ""), 0), "");
}

/// Kernel files report a size of 0, and some are endless.
TEST(RegularFile, LimitHoldsDespiteReportedSize) {
  const std::string file = "/proc/self/maps";
  ASSERT_EQ(std::filesystem::file_size(file), 0U);
  EXPECT_EQ(refusal(file, 10), file + ": is longer than 10 bytes");
}

/// Opening a pipe would wait for a writer.
TEST(RegularFile, RejectsPipesAndDevices) {
  const test::TempDirectory directory;
  const std::string pipe = directory.path("pipe");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& file : {pipe, std::string("/dev/zero")}) {
    EXPECT_EQ(refusal(file, 10), file + ": is not a regular file");
  }
  EXPECT_EQ(refusal(directory.path().string(), 10), directory.path().string() + ": is a directory");
  const std::string none = directory.path("none");
  EXPECT_EQ(refusal(none, 10), "cannot read " + none + ": No such file or directory");
}

// --- motors by path; tests/host/cli_test.cpp covers names, as unit tests have no shipped files

/// Returns the message for a missing motor, up to the list of motors.
std::string unknown_motor(const std::string& motor) {
  try {
    return "found " + find_motor_file(motor).name;
  } catch (const UnknownMotor& problem) {
    const std::string text = problem.what();
    return text.substr(0, text.find(" (in "));
  }
}

TEST(FindMotorFile, ReportsUnreadablePaths) {
  EXPECT_EQ(unknown_motor("nowhere.toml"), "cannot read nowhere.toml: No such file or directory");
  EXPECT_EQ(unknown_motor(std::string("./a\0.toml", 9)),
            "\"./a?.toml\" is not UTF-8 without control characters; give such a path");
}

std::string reason(const std::string& motor) {
  try {
    return "found " + load_profile(motor).name;
  } catch (const ConfigError& problem) {
    return problem.reason;
  }
}

/// ".." follows the kernel, not the text of the path.
TEST(FindMotorFile, FollowsSymbolicLinks) {
  const test::TempDirectory directory;
  std::filesystem::create_directories(directory.path("real/sub"));
  std::filesystem::create_directory_symlink("real/sub", directory.path("s"));
  directory.put("base.toml", "motor.pole_pairs = 65\n");
  directory.put("real/base.toml", "motor.pole_pairs = 0\n");
  directory.put("real/sub/x.toml", "extends = \"../base.toml\"\n");
  EXPECT_EQ(reason(directory.path("s/x.toml")), "0 is out of range (1 to 64)");
}

TEST(FindMotorFile, RejectsCircularExtension) {
  const test::TempDirectory directory;
  std::filesystem::create_directory(directory.path("a"));
  const std::string file = directory.put("a/my.toml", "extends = \"../a/my.toml\"\n");
  EXPECT_EQ(reason(file), "more than 8 motor files, each extending the next, or a loop of them")
      << "by another path each time";
}

// --- the model of a robot's body

std::shared_ptr<const Mechanism> no_body(const std::filesystem::path& /*model*/, SimTime /*step*/) {
  return nullptr;
}

TEST(BodyFiles, MissingModelIsAOneLineError) {
  const test::TempDirectory scratch;
  const std::string robot = (scratch.path() / "robot.toml").string();
  use_bodies(no_body);
  const LoadBody load = body_loader();
  try {
    load(robot, "gone.xml", SimTime{1});
    FAIL() << "taken";
  } catch (const std::invalid_argument& problem) {
    EXPECT_EQ(problem.what(), (scratch.path() / "gone.xml").string() +
                                  ": no such file (a path from the robot file's)");
  }
  use_bodies(nullptr);
}

}  // namespace profile_files_test
}  // namespace lk::emulator
