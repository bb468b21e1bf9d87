// Choice of the interface of a log that lk-emu replay --log compares.

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "emulator/core/start_error.hpp"
#include "tests/support/temp_directory.hpp"
#include "tools/commands/commands.hpp"

namespace lk::emulator {
namespace replay_log_test {

/// Two serial ports of a robot, each with a drive 1, and a log of both: two queries on ttyUSB0,
/// three on ttyUSB1.
class TwoPorts : public testing::Test {
 protected:
  /// Returns the report, or the error message if there is none.
  std::string report(const std::vector<std::string>& options) const {
    std::vector<std::string> words{
        "replay", "--log", log_, "--config", robot_, "--report", own_.path("report")};
    words.insert(words.end(), options.begin(), options.end());
    std::vector<const char*> argv;
    for (const std::string& word : words) argv.push_back(word.c_str());
    try {
      EXPECT_EQ(run_command(*find_command("replay"), argv), 0);
    } catch (const StartError& problem) {
      return problem.what();
    }
    std::ostringstream text;
    text << std::ifstream(own_.path("report")).rdbuf();
    return text.str();
  }
  static bool has_queries(const std::string& report, int count) {
    return report.starts_with(std::to_string(count) + " frames sent");
  }

  static std::string port(const std::string& bus) {
    return "[[bus]]\ninterface = \"" + bus + "\"\n[[bus.drive]]\nid = 1\nmotor = \"" +
           LKEMU_SOURCE_DIR "/configs/motors/mg4005.toml\"\n";
  }

  test::TempDirectory own_;
  std::string robot_ = own_.put("robot.toml", port("rs485:/dev/ttyUSB0") + port("rs485:/tmp/arm"));
  std::string log_ = own_.put("robot.log",
                              "(1.000000) ttyUSB0 rs485#3E9A0100D9\n"
                              "(1.100000) ttyUSB1 rs485#3E9A0100D9\n"
                              "(1.200000) ttyUSB0 rs485#3E9A0100D9\n"
                              "(1.300000) ttyUSB1 rs485#3E9A0100D9\n"
                              "(1.400000) ttyUSB1 rs485#3E9A0100D9\n");
};

TEST_F(TwoPorts, AreSelectedByNameOrMapping) {
  EXPECT_TRUE(has_queries(report({"--bus", "rs485:/dev/ttyUSB0"}), 2));
  EXPECT_TRUE(has_queries(report({"--bus", "rs485:/tmp/arm=ttyUSB1"}), 3));
  EXPECT_TRUE(has_queries(report({"--bus", "rs485:/dev/ttyUSB0=ttyUSB1"}), 3));
}

TEST_F(TwoPorts, ErrorListsTheInterfaces) {
  EXPECT_EQ(report({"--bus", "rs485:/tmp/arm"}),
            "replay: " + log_ +
                " has the interfaces ttyUSB0, ttyUSB1, not rs485:/tmp/arm; choose one with --bus "
                "rs485:/tmp/arm=NAME");
  EXPECT_EQ(report({"--bus", "rs485:/tmp/arm=ttyUSB7"}),
            "replay: " + log_ + " has no interface ttyUSB7, but ttyUSB0, ttyUSB1");
  EXPECT_EQ(report({"--bus", "rs485:/tmp/leg=ttyUSB1"}),
            "replay: " + robot_ + " has no bus rs485:/tmp/leg");
}

}  // namespace replay_log_test
}  // namespace lk::emulator
