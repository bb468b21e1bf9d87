// A scenario on a running bus, beside a real host.

#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/temp_directory.hpp"
#include "tests/vcan/emulator_process.hpp"
#include "tests/vcan/host.hpp"

namespace lk::vcan {
namespace live_scenario_test {

class LiveScenario : public testing::Test {
 protected:
  std::string put(const std::string& text) const { return own_.put("live.toml", text); }

  const test::TempDirectory own_;
};

std::vector<std::string> arguments(const std::string& scenario) {
  return {"--rom", ":memory:", "--control", "none",       "--bus",
          "vcan0", "--ids",    "1-2",       "--scenario", scenario};
}

TEST_F(LiveScenario, JudgesWhatARealHostSaysAndHears) {
  // The host's second command makes the drive hang, that one included.
  const std::string file = put(R"(
robot = "somewhere_else"
duration_s = 3
[[event]]
when = { id = 1, command = 0x92 }
id = 1
fault = "hang"
[[send]]
at_s = 0
id = 2
command = "off"
[[expect]]
id = 1
reply = { command = 0x9A, count = 1 }
[[expect]]
id = 1
no_reply = { command = 0x92 }
[[expect]]
id = 2
state = "off"
)");
  Host host("vcan0");
  auto with_junit = arguments(file);
  with_junit.insert(with_junit.end(), {"--junit", own_.path("junit.xml")});
  EmulatorProcess emulator(with_junit);
  ASSERT_TRUE(emulator.wait_ready());
  const auto injected = host.receive();  // the reply to the scenario's own frame
  ASSERT_TRUE(injected.has_value());
  EXPECT_EQ(injected->can_id, 0x142U);
  EXPECT_EQ(injected->data[0], 0x80);
  EXPECT_TRUE(host.query(1, {0x9A}).has_value());
  host.send(0x141, {0x92});
  const auto result = emulator.wait();  // it ends with the scenario
  EXPECT_EQ(result.status, 0) << result.out << result.err;
  EXPECT_NE(result.out.find("live: passed"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("hang of drive 1"), std::string::npos) << result.out;
  const std::string xml = own_.text_of("junit.xml");
  EXPECT_NE(xml.find("tests=\"4\" failures=\"0\" errors=\"0\""), std::string::npos) << xml;
}

TEST_F(LiveScenario, FailsWithStatus1) {
  const std::string file =
      put("duration_s = 0.2\n[[expect]]\nid = 1\nreply = { command = 0x9A }\n");
  EXPECT_EQ(EmulatorProcess(arguments(file)).wait().status, 1);
}

TEST_F(LiveScenario, IsInvalidWhenItIsCutShort) {
  const std::string file = put("duration_s = 600\n[[expect]]\nid = 1\nstate = \"running\"\n");
  EmulatorProcess emulator(arguments(file));
  ASSERT_TRUE(emulator.wait_ready());
  const auto result = emulator.stop(SIGINT);
  EXPECT_EQ(result.status, 3) << result.out;
  EXPECT_NE(result.out.find("1 expectations were still open at the end"), std::string::npos)
      << result.out;
}

TEST_F(LiveScenario, ThatNeverBeganIsInvalidInTheReportToo) {
  const std::string file = put("duration_s = 1\n[[expect]]\nid = 1\nstate = \"running\"\n");
  const std::string junit = own_.path("junit.xml");
  ASSERT_TRUE(run("ip link add vcandown type vcan"));  // and it is never brought up
  EmulatorProcess emulator({"--rom", ":memory:", "--control", "none", "--bus", "vcandown", "--ids",
                            "1", "--scenario", file, "--junit", junit});
  EXPECT_TRUE(emulator.wait_for_log("vcandown is down: waiting"));
  const auto result = emulator.stop();
  EXPECT_TRUE(run("ip link del vcandown"));
  EXPECT_EQ(result.status, 3) << result.out;
  const std::string why = "invalid: the scenario never began, an interface was down";
  EXPECT_NE(result.out.find(why + "\n"), std::string::npos) << result.out;
  const std::string xml = own_.text_of("junit.xml");
  EXPECT_NE(xml.find("tests=\"1\" failures=\"0\" errors=\"1\""), std::string::npos) << xml;
  EXPECT_NE(xml.find(why), std::string::npos) << xml;
}

TEST_F(LiveScenario, OneWithMoreFaultsThanABusKeepsIsRefused) {
  const auto faults = [](const std::string& table) {
    std::string text;
    for (int n = 0; n < 600; ++n) {
      text += "[[" + table + "]]\nat_s = 0\nid = 1\nfault = \"slow_replies\"\n";
    }
    return text;
  };
  const std::string robot =
      own_.put("robot.toml",
               "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nid = 1\n" + faults("bus.event"));
  const std::string file = put("robot = \"somewhere_else\"\nduration_s = 1\n" + faults("event") +
                               "[[expect]]\nid = 1\nstate = \"running\"\n");
  std::filesystem::create_directory(own_.path("rom"));
  own_.put("rom/vcan0-1.toml", "something");
  const auto result =
      EmulatorProcess({"--rom", own_.path("rom"), "--wipe-rom", "--record", own_.path("recording"),
                       "--control", "none", "--config", robot, "--scenario", file})
          .wait();
  EXPECT_EQ(result.status, 2);
  EXPECT_TRUE(std::filesystem::exists(own_.path("rom/vcan0-1.toml"))) << "nothing is wiped";
  EXPECT_FALSE(std::filesystem::exists(own_.path("recording")));
  EXPECT_EQ(result.out, "") << "never ready";
  EXPECT_NE(result.err.find("lk-emu: --scenario: vcan0: a bus keeps no more than 1000 faults, 600 "
                            "are there\n"),
            std::string::npos)
      << result.err;
}

}  // namespace live_scenario_test
}  // namespace lk::vcan
