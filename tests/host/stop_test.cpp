// The program's end, and its privileges.

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/host/emulator_process.hpp"
#include "tests/host/host.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::host {
namespace stop_test {

TEST(Stop, SignalsEndTheProgramWithASummary) {
  for (const int number : {SIGTERM, SIGINT}) {
    StartedEmulator emulator({"--rom", ":memory:", "--bus", own_bus(), "--ids", "1-4"});
    Host host(own_bus());
    EXPECT_TRUE(host.query(3, {0x9C}));
    const auto result = emulator.stop(number);
    EXPECT_EQ(result.status, 0);
    EXPECT_NE(result.out.find("lk-emu stopped after"), std::string::npos);
    EXPECT_NE(result.out.find(" 1 frames, 1 queries, 1 replies"), std::string::npos) << result.out;
  }
}

TEST(Privileges, AreDroppedForEveryUser) {
  StartedEmulator emulator({"--rom", ":memory:", "--bus", own_bus(), "--ids", "1"});
  auto status = process_status(emulator.pid());
  for (const char* set : {"CapInh", "CapPrm", "CapEff", "CapAmb"}) {
    EXPECT_EQ(status[set], "0000000000000000") << set;
  }
  EXPECT_EQ(status["NoNewPrivs"], "1");
}

/// Removing a link or socket needs permissions in its directory.
TEST(Privileges, RootRemovesItsFilesFromDirectoriesOfOthers) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can give a directory to another user";
  const test::TempDirectory directory;
  const std::filesystem::path own = directory.path() / "own";
  std::filesystem::create_directory(own);
  ASSERT_EQ(::chown(directory.path().c_str(), 65534, 65534), 0);
  for (const std::string& place : {directory.path("place"), (own / "place").string()}) {
    const std::vector<std::vector<std::string>> users = {
        {"--bus", "rs485:" + place},
        {"--bus", "slcan-pty:" + place},
        {"--bus", own_bus(), "--control", place},
        {"--bus", own_bus(), "--shafts", "unix:" + place}};
    for (std::vector<std::string> arguments : users) {
      SCOPED_TRACE(arguments.back());
      arguments.insert(arguments.end(), {"--rom", ":memory:", "--ids", "1"});
      StartedEmulator emulator(arguments);
      EXPECT_EQ(process_status(emulator.pid())["CapEff"], "0000000000000002") << "CAP_DAC_OVERRIDE";
      EXPECT_TRUE(std::filesystem::exists(std::filesystem::symlink_status(place)));
      EXPECT_EQ(emulator.stop().status, 0);
      EXPECT_FALSE(std::filesystem::exists(std::filesystem::symlink_status(place)));
    }
  }
}

}  // namespace stop_test
}  // namespace lk::host
