// Choice of the model file for a robot's body.

#include <gtest/gtest.h>

#include <stdexcept>

#include "emulator/core/coupling/mechanism.hpp"
#include "emulator/files/profile_files.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::emulator {
namespace body_files_test {

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

}  // namespace body_files_test
}  // namespace lk::emulator
