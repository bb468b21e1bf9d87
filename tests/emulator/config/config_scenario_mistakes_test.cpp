// Error messages of scenario files.

#include <gtest/gtest.h>

#include <algorithm>

#include "emulator/config/scenario/config_send.hpp"
#include "protocol/command_info.hpp"
#include "protocol/field_values.hpp"
#include "tests/emulator/config/config_scenario_support.hpp"

namespace lk::emulator {
namespace config_scenario_mistakes_test {

TEST(ScenarioFile, DetectsSwappedRobotAndScenario) {
  const std::string robot = "seed = 1\n[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nid = 1\n";
  const std::string not_one =
      "arm.toml:1: this is a robot, not a scenario; lk-emu --config FILE runs it";
  EXPECT_EQ(config_error([&] { parse_scenario(robot, "arm.toml", std::nullopt, kFiles); }),
            not_one);
  EXPECT_EQ(config_error([&] { parse_live_scenario(robot, "arm.toml", parse(robot), kFiles); }),
            not_one);
  const std::string not_the_other =
      "robot.toml:1: this is a scenario, not a robot; lk-emu run FILE plays it";
  EXPECT_EQ(parse_error(kHead + std::string(kExpect)), not_the_other);
  EXPECT_EQ(parse_error("robot = \"dog\"\n"), not_the_other);
}

TEST(ScenarioFile, RejectsBusTablesInAScenario) {
  const std::string bus = "[[bus]]\ninterface = \"vcan0\"\n";
  for (const std::string& text : {"duration_s = 1\n" + bus + kExpect, kHead + bus}) {
    const std::string said =
        config_error([&] { parse_scenario(text, "k.toml", std::nullopt, kFiles); });
    EXPECT_TRUE(said.ends_with(": bus: unknown key")) << said;
  }
}

TEST(ScenarioFile, RejectsMalformedHead) {
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

TEST(ScenarioFile, RejectsMalformedEvents) {
  EXPECT_EQ(mistake("[[event]]\nat_s = 11\nid = 1\npower = \"off\"\n"),
            "dir/kick.toml:4: event.at_s: is after the end of the scenario, 10 s");
  EXPECT_EQ(mistake("[[event]]\nat_s = 1\nid = 1\nfault = \"jem\"\n").substr(0, 30),
            "dir/kick.toml:6: event.fault: ");
}

TEST(ScenarioFile, ClearAppliesToFaultsOfItsBus) {
  const auto cleared = [](const std::string& bus, const std::string& which) {
    return mistake("[[event]]\nat_s = 2\nbus = \"" + bus + "\"\nclear = \"" + which +
                   "\"\n[[event]]\nat_s = 1\nid = 1\nfault = { kind = \"hang\", name = \"deaf\" "
                   "}\n[[event]]\nat_s = 1\nid = 4\nfault = \"jam\"\n");
  };
  for (const char* which : {"all", "deaf", "hang"}) EXPECT_EQ(cleared("vcan0", which), "accepted");
  EXPECT_EQ(cleared("vcan1", "jam"), "accepted");
  const std::string none = "dir/kick.toml:6: event.clear: no fault has the name or kind ";
  EXPECT_EQ(cleared("vcan0", "deaff"), none + "\"deaff\"; did you mean deaf?");
  EXPECT_EQ(cleared("vcan1", "deaf"), none + "\"deaf\"");
  EXPECT_EQ(mistake("[[event]]\nat_s = 2\nbus = \"vcan0\"\nclear = 1\n"),
            "dir/kick.toml:6: event.clear: must be a string");
}

TEST(ScenarioFile, RejectsMalformedSends) {
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
            "dir/kick.toml:8: send.iq_limit_A: this drive has it only with speed_iq_limit = true, "
            "not on MS");
  EXPECT_EQ(
      send("at_s = 1\nframe = \"14#\"\nbus = \"vcan0\"\n"),
      "dir/kick.toml:5: send.frame: \"14\" is not an identifier of 3 or 8 hexadecimal digits");
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

TEST(ScenarioFile, RejectsMalformedCommandsInWords) {
  const auto command = [](const std::string& text) {
    return mistake("[[send]]\nat_s = 1\nid = 1\ncommand = " + text);
  };
  const std::string place = "dir/kick.toml:3: send.";
  EXPECT_EQ(command("\"position_2\"\nangle_deg = 1\n"),
            "accepted");  // max speed 0: no limit of its own
  EXPECT_EQ(command("\"position_2\"\nmax_speed_dps = 1\n"), place + "angle_deg: missing");
  EXPECT_EQ(command("\"position_3\"\nangle_deg = 1\n"), place + "direction: missing");
  EXPECT_EQ(command("\"brake\"\n"), place + "brake: missing");
  EXPECT_EQ(command("\"torque\"\niq_A = 1\niq_lsb = 1\n"),
            "dir/kick.toml:8: send.iq_lsb: does not go together with iq_A");
  EXPECT_EQ(
      command("\"clear_angle\"\nangle_deg = 1\n"),
      "dir/kick.toml:7: send.angle_deg: this drive has it only with clear_angle = \"sets_angle\"");
  EXPECT_EQ(command("\"\"\n"),
            "dir/kick.toml:6: send.command: \"\" is not a command byte; write 0xA4 or \"0xA4\"");
  EXPECT_EQ(command("\"-off\"\n"),
            "dir/kick.toml:6: send.command: \"-off\" is unknown, did you mean off?");
}

/// A byte alone would send zeros as parameters, e.g. clear gains.
TEST(ScenarioFile, RejectsBareBytesOfCommandsWithPayload) {
  for (const protocol::GenerationRow& generation : protocol::kGenerationRows) {
    for (const char* const motor : {"mf7015", "ms3506"}) {
      const std::string robot =
          "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nid = 1\nmotor = \"" + std::string(motor) +
          "\"\ngeneration = \"" + std::string(generation.name) + "\"\n";
      const ServoConfig servo = parse(robot)[0].servos[0];
      const auto format = protocol::wire_format(servo.quirks.dialect, servo.profile.series);
      for (const protocol::CommandInfo& info : protocol::commands()) {
        SCOPED_TRACE(robot + std::string(info.name));
        EXPECT_FALSE(info.word.empty());
        toml::table table;
        table.insert("command", static_cast<int>(info.opcode));
        const std::string said = config_error([&] {
          TableReader reader(table, "send.toml", "send");
          read_query(reader, servo);
          reader.finish();
        });
        const bool carries = std::ranges::any_of(info.query, [&](const protocol::Field& field) {
          return protocol::present(field, {}, format) && !field.is_optional_in_scenarios;
        });
        EXPECT_EQ(said != "accepted", carries) << said;
      }
    }
  }
}

TEST(ScenarioFile, RejectsMalformedExpectations) {
  EXPECT_EQ(expect_mistake("signal = \"alive\"\nmin = 1"), "k.toml:3: expect.id: missing");
  EXPECT_EQ(expect_mistake("id = 1"),
            "k.toml:4: expect.id: missing expectation: give signal, error, state, reply, no_reply "
            "or answered");
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
  EXPECT_EQ(expect_mistake("id = 1\nunasked_deg = {}"),
            "k.toml:5: expect.unasked_deg: needs from, to or both");
  EXPECT_EQ(expect_mistake("id = 1\nunasked_deg = { from = 2, to = 1 }"),
            "k.toml:5: expect.unasked_deg.to: is below from");
  EXPECT_EQ(expect_mistake("id = 1\nstate = \"off\"\nerror = \"stall\""),
            "k.toml:5: expect.state: only one of signal, error, state, reply, no_reply and "
            "answered; this expectation has error already");
  EXPECT_EQ(expect_mistake("id = 1\nstate = \"off\"\nmin = 1"),
            "k.toml:6: expect.min: belongs to signal");
  EXPECT_EQ(expect_mistake("id = 1\nstate = \"off\"\nmax = 1"),
            "k.toml:6: expect.max: belongs to signal");
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
            "k.toml:5: expect.reply.field: missing; min and max are limits of a field");
  EXPECT_EQ(expect_mistake("id = 1\nno_reply = { count = 1 }").substr(0, 30),
            "k.toml:5: expect.no_reply.coun");
}

}  // namespace config_scenario_mistakes_test
}  // namespace lk::emulator
