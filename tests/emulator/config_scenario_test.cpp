// Scenario files: what they mean, and what is said of mistakes.

#include "emulator/config/config_scenario.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "emulator/core/frame_text.hpp"
#include "emulator/core/scenario_text.hpp"
#include "tests/emulator/config_support.hpp"

namespace lk::emulator {
namespace {

using namespace std::chrono_literals;

constexpr const char* kRobot = R"(
[[bus]]
interface = "vcan0"
[[bus.drive]]
id = 1
[[bus.drive]]
id = 2
motor = "mg4005"
generation = "v236"
[[bus.event]]
at_s = 1
ambient_C = 30
[[bus.event]]
at_s = 100
ambient_C = 40
[[bus]]
interface = "vcan1"
[[bus.drive]]
ids = "2-4"
)";

constexpr const char* kLog =
    "(1700000000.000000) can0 141#9C00000000000000 T\n"
    "(1700000000.000300) can0 141#9C19000000000000 R\n"
    "(1700000000.500000) can0 142#9A00000000000000\n"
    "(1700000001.000000) can1 141#8000000000000000\n";

const ScenarioFiles kFiles{
    .robot =
        [](const std::string& name, const Overrides& overrides) {
          if (name != "dog") throw std::invalid_argument("no robot \"" + name + "\"");
          return parse_config(kRobot, "dog.toml", overrides, find_test_profile);
        },
    .text = [](const std::string& name) -> std::string {
      if (name == "bad.log") return "rubbish";
      if (name == "drives.log") return "(1.000000) can0 141#9C00000000000000 R\n";
      if (name == "far.log") {  // 292 years
        return "(0.000000) can0 141#9C00000000000000\n(9223372035.900000) can0 "
               "141#8000000000000000\n";
      }
      if (name == "back.log") {
        return "(1.000000) can0 141#9C00000000000000\n(0.900000) can0 141#8000000000000000\n";
      }
      if (name != "x.log") throw std::invalid_argument("cannot read " + name);
      return kLog;
    },
};

constexpr const char* kHead = "robot = \"dog\"\nduration_s = 10\n";  // two lines
constexpr const char* kExpect = "\n[[expect]]\nid = 1\nstate = \"running\"\n";

Scenario parsed(const std::string& rest) {
  return parse_scenario(kHead + rest + kExpect, "dir/kick.toml", std::nullopt, kFiles);
}

std::string mistake(const std::string& rest) {
  return config_error([&] { parsed(rest); });
}

TEST(ScenarioFile, ThatIsARobotAndTheOtherWayRoundSaySo) {
  const std::string robot = "seed = 1\n[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nid = 1\n";
  const std::string not_one =
      "arm.toml:1: this is a robot, not a scenario; lk-emu --config FILE runs it";
  EXPECT_EQ(config_error([&] { parse_scenario(robot, "arm.toml", std::nullopt, kFiles); }),
            not_one);
  EXPECT_EQ(config_error([&] { parse_live_scenario(robot, "arm.toml", parse(robot), kFiles); }),
            not_one);
  EXPECT_EQ(parse_error(kHead + std::string(kExpect)),
            "robot.toml:1: this is a scenario, not a robot; lk-emu run FILE plays it");
}

std::string expect_mistake(const std::string& rest) {
  return config_error([&] {
    parse_scenario(kHead + std::string("[[expect]]\n") + rest, "k.toml", std::nullopt, kFiles);
  });
}

/// The frame of the only send.
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

TEST(ScenarioFile, HasARobotItsEventsAndItsOwn) {
  const Scenario scenario =
      parsed("[[event]]\nat_s = 0.5\nbus = \"vcan0\"\nfault = \"hang\"\nid = 2\n");
  EXPECT_EQ(scenario.name, "kick");
  EXPECT_EQ(scenario.duration, 10s);
  ASSERT_EQ(scenario.robot.size(), 2U);
  // The robot's own event of 1 s, for both drives, and not that of 100 s.
  ASSERT_EQ(scenario.robot[0].events.size(), 3U);
  EXPECT_TRUE(std::holds_alternative<SetFault>(scenario.robot[0].events[0].directive.what));
  EXPECT_EQ(scenario.robot[0].events[2].at, 1s);
  EXPECT_TRUE(scenario.robot[1].events.empty());
}

TEST(ScenarioFile, IsCalledLikeItsFile) {
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

TEST(ScenarioFile, ABusIsToldByItsDrivesWhereItCanBe) {
  EXPECT_EQ(parsed("[[send]]\nat_s = 1\nid = 4\ncommand = \"off\"\n").sends.at(0).bus, 1U);
  EXPECT_EQ(parsed("[[send]]\nat_s = 1\nframe = \"144#80\"\n").sends.at(0).bus, 1U);
  EXPECT_EQ(
      parsed("[[send]]\nat_s = 1\nbus = \"vcan1\"\nid = 2\ncommand = \"off\"\n").sends.at(0).bus,
      1U);
  EXPECT_EQ(mistake("[[send]]\nat_s = 1\nid = 2\ncommand = \"off\"\n"),
            "dir/kick.toml:3: send.bus: which one is meant? vcan0, vcan1");
  EXPECT_EQ(mistake("[[event]]\nat_s = 1\nambient_C = 3\n"),
            "dir/kick.toml:3: event.bus: which one is meant? vcan0, vcan1");
  EXPECT_EQ(mistake("[[event]]\nat_s = 1\nbus = \"can7\"\nambient_C = 3\n"),
            "dir/kick.toml:5: event.bus: \"can7\" is none of vcan0, vcan1");
  EXPECT_EQ(mistake("[[send]]\nat_s = 1\nid = 9\ncommand = \"off\"\n"),
            "dir/kick.toml:5: send.id: no drive 9 on any bus");
  EXPECT_EQ(mistake("[[send]]\nat_s = 1\nid = 1\nbus = \"vcan1\"\ncommand = \"off\"\n"),
            "dir/kick.toml:5: send.id: no drive 1 on this bus");
  // No drive answers to this one, and an identifier of 29 bits is none's, whatever its number.
  EXPECT_EQ(mistake("[[send]]\nat_s = 1\nframe = \"15F#80\"\n"),
            "dir/kick.toml:3: send.bus: which one is meant? vcan0, vcan1");
  EXPECT_EQ(mistake("[[send]]\nat_s = 1\nframe = \"00000144#80\"\n"),
            "dir/kick.toml:3: send.bus: which one is meant? vcan0, vcan1");
}

// Bytes by hand from the tables of docs/protocol.md.
TEST(ScenarioFile, CommandsInWordsAreTheDrivesOwnBytes) {
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
  // 16 mA an LSB: 100 is 0x64. 100 dps are 10000 of 0.01 dps, 0x2710.
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
  // A drive of v236 has other currents, an iq limit in 0xA2, and a brake: 66 A / 4096 an LSB.
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

TEST(ScenarioFile, PlaysWhatALogsHostSaid) {
  const auto all =
      parsed("[[send]]\nplay = \"x.log\"\nfrom_s = 2\nbus = \"vcan0\"\ninterface = \"can0\"\n");
  ASSERT_EQ(all.sends.size(), 2U);  // not what was received, not what was on can1
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

TEST(ScenarioFile, ExpectationsReadAsTheyAreMeant) {
  EXPECT_EQ(expectation_of("id = 1\nsignal = \"speed_dps\"\nmin = 90\nmax = 110\nat_s = 2"),
            "vcan0 drive 1: speed_dps 90 to 110 at 2 s");
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

TEST(ScenarioFile, MistakesOfTheHead) {
  const auto head = [](const std::string& text) {
    return config_error([&] { parse_scenario(text + kExpect, "k.toml", std::nullopt, kFiles); });
  };
  EXPECT_EQ(head("duration_s = 1"), "k.toml:1: robot: missing");
  EXPECT_EQ(head("robot = \"dog\""), "k.toml:1: duration_s: missing");
  EXPECT_EQ(head("robot = \"dog\"\nduration_s = 0"), "k.toml:2: duration_s: must be above 0");
  EXPECT_EQ(head("robot = \"cat\"\nduration_s = 1"), "k.toml:1: robot: no robot \"cat\"");
  EXPECT_EQ(head("robot = \"dog\"\nduraton_s = 1"),
            "k.toml:2: duraton_s: unknown key, did you mean duration_s?");
  EXPECT_EQ(head("robot = \"dog\"\nduration_s = 1\nbitrate = 5"),
            "k.toml:3: bitrate: 5 is out of range (0, or 10000 to 1000000 bit/s)");
  EXPECT_EQ(config_error([] { parse_scenario(kHead, "k.toml", std::nullopt, kFiles); }),
            "k.toml:1: expect: missing");
}

TEST(ScenarioFile, MistakesOfEvents) {
  EXPECT_EQ(mistake("[[event]]\nat_s = 11\nid = 1\npower = \"off\"\n"),
            "dir/kick.toml:4: event.at_s: is after the end of the scenario, 10 s");
  EXPECT_EQ(mistake("[[event]]\nat_s = 1\nid = 1\nfault = \"jem\"\n").substr(0, 30),
            "dir/kick.toml:6: event.fault: ");
}

TEST(ScenarioFile, AClearMeansAFaultOfItsBus) {
  const auto cleared = [](const std::string& bus, const std::string& which) {
    return mistake("[[event]]\nat_s = 2\nbus = \"" + bus + "\"\nclear = \"" + which +
                   "\"\n[[event]]\nat_s = 1\nid = 1\nfault = { kind = \"hang\", name = \"deaf\" "
                   "}\n[[event]]\nat_s = 1\nid = 4\nfault = \"jam\"\n");
  };
  for (const char* which : {"all", "deaf", "hang"}) EXPECT_EQ(cleared("vcan0", which), "accepted");
  EXPECT_EQ(cleared("vcan1", "jam"), "accepted");
  const std::string none = "dir/kick.toml:6: event.clear: no fault is called ";
  EXPECT_EQ(cleared("vcan0", "deaff"),
            none + "\"deaff\", and none is of that kind; did you mean deaf?");
  EXPECT_EQ(cleared("vcan1", "deaf"), none + "\"deaf\", and none is of that kind");
  EXPECT_EQ(mistake("[[event]]\nat_s = 2\nbus = \"vcan0\"\nclear = 1\n"),
            "dir/kick.toml:6: event.clear: must be a string");
}

TEST(ScenarioFile, MistakesOfSends) {
  const auto send = [](const std::string& text) { return mistake("[[send]]\n" + text); };
  EXPECT_EQ(send("id = 1\ncommand = \"off\"\n"), "dir/kick.toml:3: send.at_s: missing");
  EXPECT_EQ(send("at_s = 1\nid = 1\n"), "dir/kick.toml:3: send.command: missing");
  EXPECT_EQ(send("at_s = 1\nid = 1\ncommand = \"speed\"\n"),
            "dir/kick.toml:3: send.speed_dps: missing");
  EXPECT_EQ(send("at_s = 1\nid = 1\ncommand = \"speed\"\nsped_dps = 1\n"),
            "dir/kick.toml:7: send.sped_dps: unknown key, did you mean speed_dps?");
  EXPECT_EQ(send("at_s = 1\nid = 1\ncommand = \"off\"\nspeed_dps = 1\n").substr(0, 46),
            "dir/kick.toml:7: send.speed_dps: unknown key");
  EXPECT_EQ(send("at_s = 1\nid = 1\ncommand = \"sped\"\n"),
            "dir/kick.toml:6: send.command: \"sped\" is unknown, did you mean speed?");
  EXPECT_EQ(send("at_s = 1\nid = 1\ncommand = \"speed\"\nspeed_dps = 1\niq_limit_A = 1\n"),
            "dir/kick.toml:8: send.iq_limit_A: this drive's 0xA2 has no limit of iq (v236 has)");
  EXPECT_EQ(send("at_s = 1\nframe = \"14#\"\nbus = \"vcan0\"\n"),
            "dir/kick.toml:5: send.frame: \"14\" is no identifier of 3 or 8 hexadecimal digits");
  EXPECT_EQ(send("at_s = 1\nid = 1\nframe = \"141#\"\n"),
            "dir/kick.toml:5: send.id: does not go together with frame");
  EXPECT_EQ(send("at_s = 11\nid = 1\ncommand = \"off\"\n"),
            "dir/kick.toml:4: send.at_s: is after the end of the scenario, 10 s");
  EXPECT_EQ(send("at_s = 1\nid = 1\ncommand = \"off\"\ntimes = 3\n"),
            "dir/kick.toml:7: send.times: belongs to every_s");
  EXPECT_EQ(send("at_s = 1\nid = 1\ncommand = \"off\"\nevery_s = 0\n"),
            "dir/kick.toml:7: send.every_s: must be at least 0.00001; no bus carries more");
  EXPECT_EQ(send("at_s = 3\nid = 1\ncommand = \"off\"\nevery_s = 1\nuntil_s = 2\n"),
            "dir/kick.toml:8: send.until_s: is before at_s");
  EXPECT_EQ(send("at_s = 1\nid = 1\ncommand = \"off\"\nevery_s = 1\nuntil_s = 2\ntimes = 2\n"),
            "dir/kick.toml:8: send.until_s: does not go together with times");
  EXPECT_EQ(send("at_s = 1\nframe = 141\n"), "dir/kick.toml:5: send.frame: must be a string");
}

TEST(ScenarioFile, MistakesOfCommandsInWords) {
  const auto command = [](const std::string& text) {
    return mistake("[[send]]\nat_s = 1\nid = 1\ncommand = " + text);
  };
  const std::string place = "dir/kick.toml:3: send.";
  EXPECT_EQ(command("\"position_2\"\nangle_deg = 1\n"), place + "max_speed_dps: missing");
  EXPECT_EQ(command("\"position_3\"\nangle_deg = 1\n"), place + "direction: missing");
  EXPECT_EQ(command("\"brake\"\n"), place + "brake: missing");
  EXPECT_EQ(command("\"torque\"\niq_A = 1\niq_lsb = 1\n"),
            "dir/kick.toml:8: send.iq_lsb: does not go together with iq_A");
  EXPECT_EQ(command("\"clear_angle\"\nangle_deg = 1\n"),
            "dir/kick.toml:7: send.angle_deg: unknown key");
  EXPECT_EQ(command("\"\"\n"),
            "dir/kick.toml:6: send.command: \"\" is no command byte; write 0xA4 or \"0xA4\"");
  EXPECT_EQ(command("\"-off\"\n"),
            "dir/kick.toml:6: send.command: \"-off\" is unknown, did you mean off?");
}

TEST(ScenarioFile, MistakesOfExpectations) {
  EXPECT_EQ(expect_mistake("signal = \"alive\"\nmin = 1"), "k.toml:3: expect.id: missing");
  EXPECT_EQ(expect_mistake("id = 1"),
            "k.toml:4: expect.id: what is expected? signal, error, state, reply or no_reply");
  EXPECT_EQ(expect_mistake("id = 7\nstate = \"off\""),
            "k.toml:4: expect.id: no drive 7 on any bus");
  EXPECT_EQ(expect_mistake("id = 7\nbus = \"vcan0\"\nstate = \"off\""),
            "k.toml:4: expect.id: no drive 7 on this bus");
  EXPECT_EQ(expect_mistake("id = 1\nsignal = \"alive\""),
            "k.toml:5: expect.signal: needs min, max or both");
  EXPECT_EQ(expect_mistake("id = 1\nsignal = \"alive\"\nmin = 2\nmax = 1"),
            "k.toml:7: expect.max: is below min");
  EXPECT_EQ(expect_mistake("id = 1\nsignal = \"speed_dp\"\nmin = 2"),
            "k.toml:5: expect.signal: \"speed_dp\" is unknown, did you mean speed_dps?");
  EXPECT_EQ(expect_mistake("id = 1\nstate = \"off\"\nerror = \"stall\""),
            "k.toml:5: expect.state: one thing at a time; this one has error already");
  EXPECT_EQ(expect_mistake("id = 1\nstate = \"off\"\nmin = 1"),
            "k.toml:6: expect.min: belongs to signal");
  EXPECT_EQ(expect_mistake("id = 1\nstate = \"off\"\nset = true"),
            "k.toml:6: expect.set: belongs to error");
  EXPECT_EQ(expect_mistake("id = 1\nmin = 1\nsingal = \"speed_dps\""),
            "k.toml:6: expect.singal: unknown key, did you mean signal?");
  for (const char* other : {"by_s", "from_s", "to_s"}) {
    EXPECT_EQ(expect_mistake("id = 1\nstate = \"off\"\nat_s = 1\n" + std::string(other) + " = 2"),
              "k.toml:6: expect.at_s: does not go together with by_s, from_s and to_s");
  }
  EXPECT_EQ(expect_mistake("id = 1\nstate = \"off\"\nfrom_s = 1\nto_s = 3\nby_s = 2"),
            "k.toml:8: expect.by_s: does not go together with to_s");
  EXPECT_EQ(expect_mistake("id = 1\nstate = \"off\"\nto_s = 1"),
            "k.toml:6: expect.to_s: needs from_s");
  EXPECT_EQ(expect_mistake("id = 1\nstate = \"off\"\nfrom_s = 2\nto_s = 1"),
            "k.toml:7: expect.to_s: is before from_s");
  EXPECT_EQ(expect_mistake("id = 1\nstate = \"off\"\nfrom_s = 2\nby_s = 1"),
            "k.toml:7: expect.by_s: is before from_s");
  EXPECT_EQ(expect_mistake("id = 1\nstate = \"off\"\nat_s = 11"),
            "k.toml:6: expect.at_s: is after the end of the scenario, 10 s");
  EXPECT_EQ(expect_mistake("id = 1\nreply = {}\nat_s = 1"),
            "k.toml:6: expect.at_s: replies take a while: use from_s and to_s, or by_s");
  for (const char* other : {"min_count", "max_count"}) {
    EXPECT_EQ(expect_mistake("id = 1\nreply = { count = 1, " + std::string(other) + " = 1 }"),
              "k.toml:5: expect.reply.count: does not go together with min_count and max_count");
  }
  EXPECT_EQ(expect_mistake("id = 1\nreply = { min_count = 2, max_count = 1 }"),
            "k.toml:5: expect.reply.max_count: is below min_count");
  EXPECT_EQ(expect_mistake("id = 1\nreply = { field = \"iq_A\" }"),
            "k.toml:5: expect.reply.field: needs min, max or both");
  EXPECT_EQ(expect_mistake("id = 1\nreply = { min = 1 }"),
            "k.toml:5: expect.reply.field: missing: what are min and max of?");
  EXPECT_EQ(expect_mistake("id = 1\nno_reply = { count = 1 }").substr(0, 30),
            "k.toml:5: expect.no_reply.coun");
}

TEST(ScenarioFile, ALiveOneHasTheBusesThatRun) {
  const auto running = parse_config(kRobot, "dog.toml", {}, find_test_profile);
  const Scenario scenario = parse_live_scenario(
      "robot = \"whatever\"\nseed = 3\nduration_s = 2\n[[event]]\nat_s = 1\nid = 1\n"
      "power = \"off\"\n" +
          std::string(kExpect),
      "k.toml", running, kFiles);
  ASSERT_EQ(scenario.robot.size(), 2U);
  // The robot's own events go on by themselves; only the scenario's are its.
  ASSERT_EQ(scenario.robot[0].events.size(), 1U);
  EXPECT_TRUE(std::holds_alternative<PowerOff>(scenario.robot[0].events[0].directive.what));
}

TEST(ScenarioFile, ALiveOnesBusesAreMatchedByOrderOnOtherInterfaces) {
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

TEST(ScenarioFile, ALiveOnesBusesAreMatchedByNameWhereItIsThere) {
  auto running = parse_config(kRobot, "dog.toml", {}, find_test_profile);
  std::swap(running[0], running[1]);
  const std::string event = "[[event]]\nat_s = 1\nbus = \"vcan1\"\nid = 3\npower = \"off\"\n";
  const Scenario scenario = parse_live_scenario(kHead + event + kExpect, "k.toml", running, kFiles);
  EXPECT_EQ(scenario.robot[0].interface, "vcan1");
  EXPECT_EQ(scenario.robot[0].events.size(), 1U);
  EXPECT_TRUE(scenario.robot[1].events.empty());
}

TEST(ScenarioFile, ALiveOnesBusesAreMatchedByOrderOnlyWhereThereAreAsMany) {
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
            "k.toml:5: event.bus: \"vcan0\" is none of can5");
}

// The same file runs offline and against a real host.
TEST(ScenarioFile, AClearMayMeanAFaultOfTheRobotThatRuns) {
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
            "k.toml:6: event.clear: no fault is called \"rust\", and none is of that kind");
}

TEST(ScenarioFile, ALiveOneNeedsNoRobot) {
  const auto running = parse_config(kRobot, "dog.toml", {}, find_test_profile);
  const Scenario scenario =
      parse_live_scenario(std::string("duration_s = 2\n") + kExpect, "k.toml", running, kFiles);
  EXPECT_EQ(scenario.expectations.size(), 1U);
  EXPECT_EQ(scenario.robot.size(), 2U);
}

}  // namespace
}  // namespace lk::emulator
