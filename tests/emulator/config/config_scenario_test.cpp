// Meaning of scenario files.

#include "emulator/config/scenario/config_scenario.hpp"

#include <gtest/gtest.h>

#include "emulator/core/frame_text.hpp"
#include "emulator/core/scenario/scenario_text.hpp"
#include "tests/emulator/config/config_scenario_support.hpp"

namespace lk::emulator {
namespace config_scenario_test {

using namespace std::chrono_literals;

/// Returns the frame of the only send.
std::string frame_of(const std::string& send) {
  const Scenario scenario = parsed("[[send]]\nat_s = 1\n" + send);
  EXPECT_EQ(scenario.sends.size(), 1U);
  return scenario.sends.empty() ? "" : frame_text(scenario.sends[0].frame);
}

std::string expectation_of(const std::string& expect) {
  const Scenario scenario =
      parse_scenario(kHead + std::string("[[expect]]\n") + expect, "k.toml", std::nullopt, kFiles);
  return expectation_text(scenario.expectations.at(0),
                          scenario.robot[scenario.expectations[0].bus].interface);
}

TEST(ScenarioFile, MergesEventsOfTheRobotWithItsOwn) {
  const Scenario scenario =
      parsed("[[event]]\nat_s = 0.5\nbus = \"vcan0\"\nfault = \"hang\"\nid = 2\n");
  EXPECT_EQ(scenario.name, "kick");
  EXPECT_EQ(scenario.duration, 10s);
  ASSERT_EQ(scenario.robot.size(), 2U);
  // The robot's own event at 1 s, for both drives, but not the one at 100 s.
  ASSERT_EQ(scenario.robot[0].events.size(), 3U);
  EXPECT_TRUE(std::holds_alternative<SetFault>(scenario.robot[0].events[0].directive.what));
  EXPECT_EQ(scenario.robot[0].events[2].at, 1s);
  EXPECT_TRUE(scenario.robot[1].events.empty());
}

TEST(ScenarioFile, IsNamedAfterItsFile) {
  const auto name_of = [](const std::string& file) {
    return parse_scenario(std::string(kHead) + kExpect, file, std::nullopt, kFiles).name;
  };
  EXPECT_EQ(name_of("kick.toml"), "kick");
  EXPECT_EQ(name_of("../a.toml/kick"), "kick");
}

TEST(ScenarioFile, SeedOfTheCommandLineWins) {
  const std::string text = kHead + std::string("seed = 7\nbitrate = 0\n") + kExpect;
  EXPECT_EQ(parse_scenario(text, "k.toml", std::nullopt, kFiles).robot[0].seed, 7U);
  EXPECT_EQ(parse_scenario(text, "k.toml", 9, kFiles).robot[0].seed, 9U);
  EXPECT_EQ(parse_scenario(text, "k.toml", 9, kFiles).robot[0].bitrate, 0);
}

TEST(ScenarioFile, InfersTheBusFromTheDrives) {
  EXPECT_EQ(parsed("[[send]]\nat_s = 1\nid = 4\ncommand = \"off\"\n").sends.at(0).bus, 1U);
  EXPECT_EQ(parsed("[[send]]\nat_s = 1\nframe = \"144#80\"\n").sends.at(0).bus, 1U);
  EXPECT_EQ(
      parsed("[[send]]\nat_s = 1\nbus = \"vcan1\"\nid = 2\ncommand = \"off\"\n").sends.at(0).bus,
      1U);
  EXPECT_EQ(mistake("[[send]]\nat_s = 1\nid = 2\ncommand = \"off\"\n"),
            "dir/kick.toml:3: send.bus: ambiguous; give one of vcan0, vcan1");
  EXPECT_EQ(mistake("[[event]]\nat_s = 1\nambient_C = 3\n"),
            "dir/kick.toml:3: event.bus: ambiguous; give one of vcan0, vcan1");
  EXPECT_EQ(mistake("[[event]]\nat_s = 1\nbus = \"can7\"\nambient_C = 3\n"),
            "dir/kick.toml:5: event.bus: \"can7\" is not one of vcan0, vcan1");
  EXPECT_EQ(mistake("[[send]]\nat_s = 1\nid = 9\ncommand = \"off\"\n"),
            "dir/kick.toml:5: send.id: no drive 9 on any bus");
  EXPECT_EQ(mistake("[[send]]\nat_s = 1\nid = 1\nbus = \"vcan1\"\ncommand = \"off\"\n"),
            "dir/kick.toml:5: send.id: no drive 1 on this bus");
  // No drive has this identifier, and no drive has an identifier of 29 bits.
  EXPECT_EQ(mistake("[[send]]\nat_s = 1\nframe = \"15F#80\"\n"),
            "dir/kick.toml:3: send.bus: ambiguous; give one of vcan0, vcan1");
  EXPECT_EQ(mistake("[[send]]\nat_s = 1\nframe = \"00000144#80\"\n"),
            "dir/kick.toml:3: send.bus: ambiguous; give one of vcan0, vcan1");
}

// Bytes by hand from the tables of docs/reference/protocol.md.
TEST(ScenarioFile, EncodesCommandsInWords) {
  const std::string one = "id = 1\ncommand = ";
  EXPECT_EQ(frame_of(one + "\"off\""), "141#8000000000000000");
  EXPECT_EQ(frame_of(one + "\"stop\""), "141#8100000000000000");
  EXPECT_EQ(frame_of(one + "\"run\""), "141#8800000000000000");
  EXPECT_EQ(frame_of(one + "\"clear_errors\""), "141#9B00000000000000");
  EXPECT_EQ(frame_of(one + "\"state_1\""), "141#9A00000000000000");
  EXPECT_EQ(frame_of(one + "\"state_2\""), "141#9C00000000000000");
  EXPECT_EQ(frame_of(one + "0x9D"), "141#9D00000000000000");
  EXPECT_EQ(frame_of(one + "\"0x92\""), "141#9200000000000000");
  EXPECT_EQ(frame_of(one + "\"multi_turn_angle\""), "141#9200000000000000");
  // 16 mA per LSB: 100 is 0x64. 100 dps are 10000 of 0.01 dps, 0x2710.
  EXPECT_EQ(frame_of(one + "\"torque\"\niq_A = 1.6"), "141#A100000064000000");
  EXPECT_EQ(frame_of(one + "\"torque\"\niq_lsb = -100"), "141#A10000009CFF0000");
  EXPECT_EQ(frame_of(one + "\"speed\"\nspeed_dps = 100"), "141#A200000010270000");
  // 500 dps are 0x1F4; 360 degrees are 36000 of 0.01 degrees, 0x8CA0; -1 degree is 0xFFFFFF9C.
  EXPECT_EQ(frame_of(one + "\"position_1\"\nangle_deg = 360"), "141#A3000000A08C0000");
  EXPECT_EQ(frame_of(one + "\"position_2\"\nangle_deg = -1\nmax_speed_dps = 500"),
            "141#A400F4019CFFFFFF");
  EXPECT_EQ(frame_of(one + "\"position_3\"\nangle_deg = 90\ndirection = \"counterclockwise\""),
            "141#A501000028230000");
  EXPECT_EQ(frame_of(one + "0xA6\nangle_deg = 90\ndirection = \"clockwise\"\nmax_speed_dps = 500"),
            "141#A600F40128230000");
  EXPECT_EQ(frame_of(one + "\"position_5\"\nturn_deg = -1"), "141#A70000009CFFFFFF");
  EXPECT_EQ(frame_of(one + "\"position_6\"\nturn_deg = 360\nmax_speed_dps = 500"),
            "141#A800F401A08C0000");
  EXPECT_EQ(frame_of(one + "\"clear_angle\""), "141#9500000000000000");
  // A v236 drive has another current scale (66 A / 4096 per LSB), an iq limit in 0xA2, and a brake.
  const std::string two = "bus = \"vcan0\"\nid = 2\ncommand = ";
  EXPECT_EQ(frame_of(two + "\"torque\"\niq_A = 1.611328125"), "142#A100000064000000");
  EXPECT_EQ(frame_of(two + "\"speed\"\nspeed_dps = 100\niq_limit_A = 1.611328125"),
            "142#A200640010270000");
  EXPECT_EQ(frame_of(two + "\"brake\"\nbrake = \"release\""), "142#8C01000000000000");
  EXPECT_EQ(frame_of(two + "\"clear_angle\"\nangle_deg = 90"), "142#9500000028230000");
  EXPECT_EQ(frame_of("frame = \"141#A4002C0150C30000\""), "141#A4002C0150C30000");
}

TEST(ScenarioFile, SendsRepeat) {
  const auto send = [](const std::string& more) {
    return parsed("[[send]]\nat_s = 1\nid = 1\ncommand = \"off\"\n" + more).sends.at(0);
  };
  EXPECT_EQ(send("").times, 1U);
  EXPECT_EQ(send("every_s = 0.5\n").times, 19U);  // 1, 1.5 … 10
  EXPECT_EQ(send("every_s = 0.5\nuntil_s = 2\n").times, 3U);
  EXPECT_EQ(send("every_s = 0.5\ntimes = 4\n").times, 4U);
  EXPECT_EQ(send("every_s = 0.5\ntimes = 400\n").times, 19U);
  EXPECT_EQ(parsed("[[send]]\nat_s = 1\nbus = \"vcan1\"\ncommand = \"off\"\n").sends.size(), 3U);
}

TEST(ScenarioFile, PlaysHostFramesOfALog) {
  const auto all =
      parsed("[[send]]\nplay = \"x.log\"\nfrom_s = 2\nbus = \"vcan0\"\ninterface = \"can0\"\n");
  ASSERT_EQ(all.sends.size(), 2U);  // without received frames and can1
  EXPECT_EQ(all.sends[0].at, 2s);
  EXPECT_EQ(all.sends[1].at, 2500ms);
  EXPECT_EQ(frame_text(all.sends[1].frame), "142#9A00000000000000");
  EXPECT_EQ(mistake("[[send]]\nplay = \"bad.log\"\nbus = \"vcan0\"\n").substr(0, 10), "bad.log:1:");
  EXPECT_EQ(mistake("[[send]]\nplay = \"none.log\"\nbus = \"vcan0\"\n"),
            "dir/kick.toml:4: send.play: cannot read none.log");
  EXPECT_EQ(mistake("[[send]]\nplay = \"back.log\"\nbus = \"vcan0\"\n"),
            "dir/kick.toml:4: send.play: the times of back.log go back");
  EXPECT_EQ(mistake("[[send]]\nplay = \"drives.log\"\nbus = \"vcan0\"\n"),
            "dir/kick.toml:4: send.play: drives.log has no frame of a host to play");
  EXPECT_EQ(parsed("[[send]]\nplay = \"far.log\"\nfrom_s = 2\nbus = \"vcan0\"\n").sends.size(), 1U)
      << "what comes after the end is left out";
}

TEST(ScenarioFile, PrintsExpectations) {
  EXPECT_EQ(expectation_of("id = 1\nsignal = \"speed_dps\"\nmin = 90\nmax = 110\nat_s = 2"),
            "vcan0 drive 1: speed_dps 90 to 110 at 2 s");
  EXPECT_EQ(expectation_of("id = 1\nunasked_deg = { to = 5 }\nat_s = 2"),
            "vcan0 drive 1: unasked_deg at most 5 at 2 s");
  EXPECT_EQ(expectation_of("id = 1\nsignal = \"speed_dps\"\nmin = 90\nby_s = 2\nfrom_s = 1"),
            "vcan0 drive 1: speed_dps at least 90 from 1 s by 2 s");
  EXPECT_EQ(expectation_of("id = 4\nerror = \"stall\"\nset = false\nfrom_s = 1"),
            "vcan1 drive 4: error stall not set from 1 s to 10 s");
  EXPECT_EQ(expectation_of("id = 1\nstate = \"off\""), "vcan0 drive 1: off at 10 s");
  EXPECT_EQ(expectation_of("id = 1\nreply = { command = 0x9C, count = 3 }\nfrom_s = 1\nto_s = 2"),
            "vcan0 drive 1: 3 replies to 0x9C from 1 s to 2 s");
  EXPECT_EQ(expectation_of("id = 1\nreply = { command = \"state_1\", error = \"stall\" }"),
            "vcan0 drive 1: a reply to 0x9A with error stall from 0 s to 10 s");
  EXPECT_EQ(expectation_of("id = 1\nno_reply = { max_delay_ms = 3 }\nby_s = 4"),
            "vcan0 drive 1: no reply, at most 3 ms after the query by 4 s");
}

TEST(ScenarioFile, LiveUsesTheRunningBuses) {
  const auto running = parse_config(kRobot, "dog.toml", {}, find_test_profile);
  const Scenario scenario = parse_live_scenario(
      "robot = \"whatever\"\nseed = 3\nduration_s = 2\n[[event]]\nat_s = 1\nid = 1\n"
      "power = \"off\"\n" +
          std::string(kExpect),
      "k.toml", running, kFiles);
  ASSERT_EQ(scenario.robot.size(), 2U);
  // The scenario contains only its own events; the robot's run independently.
  ASSERT_EQ(scenario.robot[0].events.size(), 1U);
  EXPECT_TRUE(std::holds_alternative<PowerOff>(scenario.robot[0].events[0].directive.what));
}

TEST(ScenarioFile, LiveMatchesBusesByOrder) {
  auto running = parse_config(kRobot, "dog.toml", {}, find_test_profile);
  running[0].interface = "can5";
  running[1].interface = "can6";
  const Scenario scenario = parse_live_scenario(
      kHead + std::string("[[event]]\nat_s = 1\nbus = \"vcan1\"\nid = 2\npower = \"off\"\n") +
          kExpect,
      "k.toml", running, kFiles);
  EXPECT_EQ(scenario.robot[1].interface, "can6");
  EXPECT_EQ(scenario.robot[1].events.size(), 1U);
}

TEST(ScenarioFile, LivePrefersMatchingBusNames) {
  auto running = parse_config(kRobot, "dog.toml", {}, find_test_profile);
  std::swap(running[0], running[1]);
  const std::string event = "[[event]]\nat_s = 1\nbus = \"vcan1\"\nid = 3\npower = \"off\"\n";
  const Scenario scenario = parse_live_scenario(kHead + event + kExpect, "k.toml", running, kFiles);
  EXPECT_EQ(scenario.robot[0].interface, "vcan1");
  EXPECT_EQ(scenario.robot[0].events.size(), 1U);
  EXPECT_TRUE(scenario.robot[1].events.empty());
}

TEST(ScenarioFile, LiveMatchesByOrderOnlyForEqualCounts) {
  auto running = parse_config(kRobot, "dog.toml", {}, find_test_profile);
  running.pop_back();
  running[0].interface = "can5";
  EXPECT_EQ(config_error([&] {
              parse_live_scenario(kHead +
                                      std::string("[[event]]\nat_s = 1\nbus = \"vcan0\"\nid "
                                                  "= 1\npower = \"off\"\n") +
                                      kExpect,
                                  "k.toml", running, kFiles);
            }),
            "k.toml:5: event.bus: \"vcan0\" is not one of can5");
}

// One file for offline runs and for a real host.
TEST(ScenarioFile, LiveClearsFaultsOfTheRunningRobot) {
  const std::string robot =
      std::string(kRobot) +
      "[[bus.event]]\nat_s = 1\nfault = { kind = \"jam\", name = \"rust\" }\n";
  auto running = parse_config(robot, "dog.toml", {}, find_test_profile);
  ScenarioFiles files = kFiles;
  files.robot = [&](const std::string&, const Overrides&) { return running; };
  const auto error = [&](const std::string& clear) {
    const std::string text = kHead + std::string("[[event]]\nat_s = 2\n") + clear + kExpect;
    std::string offline =
        config_error([&] { parse_scenario(text, "k.toml", std::nullopt, files); });
    EXPECT_EQ(config_error([&] { parse_live_scenario(text, "k.toml", running, files); }), offline);
    return offline;
  };
  EXPECT_EQ(error("bus = \"vcan1\"\nclear = \"rust\""), "accepted");
  EXPECT_EQ(error("bus = \"vcan0\"\nclear = \"rust\""),
            "k.toml:6: event.clear: no fault has the name or kind \"rust\"");
}

TEST(ScenarioFile, LiveRejectsOtherRobot) {
  const auto running = parse_config(
      "[[bus]]\ninterface = \"can5\"\n[[bus.drive]]\nids = \"1-2\"\n"
      "[[bus]]\ninterface = \"can6\"\n[[bus.drive]]\nids = \"2-3\"\n",
      "other.toml", {}, find_test_profile);
  const std::string text =
      kHead + std::string("[[expect]]\nbus = \"vcan0\"\nid = 1\nstate = \"off\"\n");
  const auto mismatches = parse_live_scenario(text, "k.toml", running, kFiles).mismatches;
  ASSERT_EQ(mismatches.size(), 2U);
  const std::string& plain = running[0].servos[0].profile.name;
  EXPECT_EQ(mismatches[0], (DriveMismatch{"can5", 2, "mg4005", plain}));
  EXPECT_EQ(mismatches[1], (DriveMismatch{"can6", 4, plain, ""}));
  const auto own = parse_config(kRobot, "dog.toml", {}, find_test_profile);
  EXPECT_TRUE(parse_live_scenario(text, "k.toml", own, kFiles).mismatches.empty());
}

TEST(ScenarioFile, LiveNeedsNoRobot) {
  const auto running = parse_config(kRobot, "dog.toml", {}, find_test_profile);
  const Scenario scenario =
      parse_live_scenario(std::string("duration_s = 2\n") + kExpect, "k.toml", running, kFiles);
  EXPECT_EQ(scenario.expectations.size(), 1U);
  EXPECT_EQ(scenario.robot.size(), 2U);
}

}  // namespace config_scenario_test
}  // namespace lk::emulator
