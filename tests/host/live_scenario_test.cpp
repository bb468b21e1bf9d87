// A scenario on a running bus, together with an independent host.

#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/host/control_client.hpp"
#include "tests/host/emulator_process.hpp"
#include "tests/host/host.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::host {
namespace live_scenario_test {

class LiveScenario : public testing::Test {
 protected:
  std::string put(const std::string& text) const { return own_.put("live.toml", text); }

  const test::TempDirectory own_;
};

std::vector<std::string> arguments(const std::string& scenario) {
  return {"--rom",   ":memory:", "--control", "none",       "--bus",
          own_bus(), "--ids",    "1-2",       "--scenario", scenario};
}

TEST_F(LiveScenario, EvaluatesTrafficOfARealHost) {
  // The host's second command triggers the hang, and is itself not answered.
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
  auto stepped = arguments(file);
  stepped[3] = own_.path("s");
  stepped.insert(stepped.end(), {"--clock", "stepped", "--junit", own_.path("junit.xml")});
  StartedEmulator emulator(stepped);
  Host host(own_bus());
  const auto advance = [&](const char* by_s) {
    return ask(own_.path("s"), "POST /clock/advance", std::string("{\"by_s\": ") + by_s + "}")
        .status;
  };
  ASSERT_EQ(advance("0.01"), 200);
  const auto injected = host.receive();  // the scenario's own frame
  ASSERT_TRUE(injected.has_value());
  EXPECT_EQ(injected->can_id, 0x142U);
  EXPECT_EQ(injected->data[0], 0x80);
  host.send(0x141, {0x9A});
  ASSERT_EQ(advance("0.01"), 200);
  const auto reply = host.receive();
  ASSERT_TRUE(reply.has_value());
  EXPECT_EQ(reply->data[0], 0x9A);
  host.send(0x141, {0x92});
  advance("3");
  const auto result = emulator.wait();  // the program ends with the scenario
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

TEST_F(LiveScenario, IsInvalidIfItEndsEarly) {
  const std::string file = put("duration_s = 600\n[[expect]]\nid = 1\nstate = \"running\"\n");
  StartedEmulator emulator(arguments(file));
  const auto result = emulator.stop(SIGINT);
  EXPECT_EQ(result.status, 3) << result.out;
  EXPECT_NE(result.out.find("1 expectations were still open at the end"), std::string::npos)
      << result.out;
}

TEST_F(LiveScenario, RejectsTooManyFaults) {
  const auto faults = [](const std::string& table) {
    std::string text;
    for (int n = 0; n < 600; ++n) {
      text += "[[" + table + "]]\nat_s = 0\nid = 1\nfault = \"slow_replies\"\n";
    }
    return text;
  };
  const std::string robot =
      own_.put("robot.toml", "[[bus]]\ninterface = \"" + own_bus() + "\"\n[[bus.drive]]\nid = 1\n" +
                                 faults("bus.event"));
  const std::string file = put("robot = \"somewhere_else\"\nduration_s = 1\n" + faults("event") +
                               "[[expect]]\nid = 1\nstate = \"running\"\n");
  std::filesystem::create_directory(own_.path("rom"));
  own_.put("rom/" + own_bus() + "-1.toml", "something");
  const auto result =
      EmulatorProcess({"--rom", own_.path("rom"), "--wipe-rom", "--record", own_.path("recording"),
                       "--control", "none", "--config", robot, "--scenario", file})
          .wait();
  EXPECT_EQ(result.status, 2);
  EXPECT_TRUE(std::filesystem::exists(own_.path("rom/" + own_bus() + "-1.toml")))
      << "nothing is wiped";
  EXPECT_FALSE(std::filesystem::exists(own_.path("recording")));
  EXPECT_EQ(result.out, "") << "never ready";
  EXPECT_NE(result.err.find("lk-emu: --scenario: " + own_bus() +
                            ": a bus holds at most 1000 faults, 600 are there\n"),
            std::string::npos)
      << result.err;
}

}  // namespace live_scenario_test
}  // namespace lk::host
