// Directives in files and in tables without text.

#include "emulator/config/events/config_directives.hpp"

#include <gtest/gtest.h>

#include <map>

#include "emulator/config/register_fields.hpp"
#include "emulator/core/bus/bus.hpp"
#include "emulator/core/servo/signals.hpp"
#include "tests/emulator/config/config_support.hpp"

namespace lk::emulator {
namespace config_directives_test {

using namespace std::chrono_literals;

Condition only_condition(const std::string& keys) {
  const auto events = events_of(keys + "\nmark = \"now\"");
  EXPECT_EQ(events.size(), 1U) << keys;
  return events[0].when.value();
}

// --- other directives for the whole bus, and settings

TEST(Vocabulary, ReadsClearAndMark) {
  const auto clear_of = [](const std::string& which) {
    const auto events = events_of(
        "at_s = 3\nclear = \"" + which +
        "\"\n[[bus.event]]\nat_s = 1\nfault = \"jam\"\n[[bus.event]]\nat_s = 2\nfault = { "
        "kind = \"hang\", name = \"deaf\" }\n[[bus.event]]\nat_s = 2\nfault = \"jam\"");
    EXPECT_EQ(events.size(), 4U);
    return std::get<ClearFault>(events[3].directive.what).which;
  };
  for (const char* which : {"all", "jam", "jam-2", "hang", "deaf"})
    EXPECT_EQ(clear_of(which), which);
  const auto marks = events_of("at_s = 1\nmark = \"the door opens\"");
  ASSERT_EQ(marks.size(), 1U);
  EXPECT_EQ(std::get<Mark>(marks[0].directive.what).text, "the door opens");
}

TEST(Vocabulary, RejectsMalformedClearAndMark) {
  const std::string jam = "[[bus.event]]\nat_s = 0\nfault = \"jam\"";
  const std::map<std::string, std::string> errors = {
      {"clear = \"jam\"", "robot.toml:11: bus.event.clear: no fault has the name or kind \"jam\""},
      {"clear = \"jm\"\n" + jam,
       "robot.toml:11: bus.event.clear: no fault has the name or kind \"jm\"; did you mean jam?"},
      {"clear = \"jam-2\"\n" + jam,
       "robot.toml:11: bus.event.clear: no fault has the name or kind \"jam-2\"; did you mean "
       "jam?"},
      {"clear = true", "robot.toml:11: bus.event.clear: must be a string"},
      {"id = 2\nclear = \"all\"",
       "robot.toml:11: bus.event.id: clear acts on the whole bus; remove this key"},
      {"id = 2\nmark = \"x\"",
       "robot.toml:11: bus.event.id: mark acts on the whole bus; remove this key"},
      {R"(mark = "a\u001Bb")",
       "robot.toml:11: bus.event.mark: must be one line without control characters"},
      {R"(mark = "a\u007Fb")",
       "robot.toml:11: bus.event.mark: must be one line without control characters"},
      {"mark = \"" + std::string(1001, 'x') + "\"",
       "robot.toml:11: bus.event.mark: is longer than 1000 bytes"},
  };
  for (const auto& [keys, error] : errors) EXPECT_EQ(error_of("at_s = 1\n" + keys), error) << keys;
}

TEST(Vocabulary, MakesOneDirectivePerSetting) {
  const auto events = events_of(
      "at_s = 1\nid = 5\nsettings = { max_speed_dps = 90, gains = { speed_kp = 7 }, "
      "acceleration_dps_s = 3, encoder_offset = 4, max_torque_current_lsb = 5, max_angle_deg = 6, "
      "current_ramp_A_s = 8, broadcast_mode = true, protection = { stall = { enabled = true } } }");
  std::vector<RomParameter> written;
  for (const auto& event : events) {
    EXPECT_EQ(event.directive.id, 5);
    const auto& setting = std::get<Setting>(event.directive.what);
    written.push_back(setting.parameter);
    EXPECT_EQ(setting.value.max_speed_dps, 90);
    EXPECT_EQ(setting.value.gains.speed_kp, 7);
    EXPECT_EQ(setting.value.acceleration_dps_s, 3);
    EXPECT_EQ(setting.value.encoder_offset, 4);
    EXPECT_EQ(setting.value.max_torque_current_lsb, 5);
    EXPECT_EQ(setting.value.max_angle_deg, 6);
    EXPECT_EQ(setting.value.current_ramp_A_s, 8);
    EXPECT_TRUE(setting.value.broadcast_mode);
    EXPECT_TRUE(setting.value.protections[static_cast<std::size_t>(model::Error::kStall)].enabled);
  }
  EXPECT_EQ(written, (std::vector{RomParameter::kGains, RomParameter::kAcceleration,
                                  RomParameter::kEncoderOffset, RomParameter::kMaxTorqueCurrent,
                                  RomParameter::kMaxSpeed, RomParameter::kMaxAngle,
                                  RomParameter::kCurrentRamp, RomParameter::kBroadcastMode,
                                  RomParameter::kProtections}));
  const auto ms = events_of("at_s = 1\nid = 7\nsettings = { max_power_permille = 300 }");
  ASSERT_EQ(ms.size(), 1U);
  EXPECT_EQ(std::get<Setting>(ms[0].directive.what).parameter, RomParameter::kMaxPower);
  EXPECT_EQ(std::get<Setting>(ms[0].directive.what).value.max_power_permille, 300);
}

TEST(Vocabulary, RejectsMalformedSettings) {
  const std::string place = "robot.toml:12: bus.event.settings";
  const std::map<std::string, std::string> errors = {
      {"settings = {}", place + ": empty; give at least one setting"},
      {"settings = { max_sped_dps = 1 }",
       place + ".max_sped_dps: unknown key, did you mean max_speed_dps?"},
      {"settings = { max_speed_dps = 0 }",
       place + ".max_speed_dps: 0 is out of range (1 to 72000)"},
      {"settings = { gains = { angle_kp = 256 } }",
       place + ".gains.angle_kp: 256 is out of range (0 to 255)"},
      // 14 bits on the wire for this motor
      {"settings = { encoder_offset = 20000 }",
       place + ".encoder_offset: does not fit the encoder of this motor (14 bit on the wire)"},
      {"settings = { protection = { under_voltage = { enabled = true, threshold_V = 3 } } }",
       place + ".protection.under_voltage.threshold_V: under-voltage at 3 V is never reported: the "
               "controller does not start below 5.5 V"},
  };
  for (const auto& [keys, error] : errors) {
    EXPECT_EQ(error_of("at_s = 1\nid = 2\n" + keys), error) << keys;
  }
}

// --- conditions

TEST(Vocabulary, ReadsEveryCondition) {
  for (const Signal& signal : signals()) {
    const auto when = only_condition("when = { id = 2, signal = \"" + std::string(signal.name) +
                                     "\", above = 1.5 }");
    EXPECT_EQ(when.id, 2);
    EXPECT_EQ(std::get<SignalReaches>(when.what).signal, &signal);
  }
  const std::map<std::string, Edge> edges = {
      {"above", Edge::kAbove}, {"below", Edge::kBelow}, {"crosses", Edge::kCrosses}};
  for (const auto& [word, edge] : edges) {
    const auto when =
        only_condition("when = { id = 5, signal = \"speed_dps\", " + word + " = -2.5 }");
    EXPECT_EQ(std::get<SignalReaches>(when.what).edge, edge);
    EXPECT_EQ(std::get<SignalReaches>(when.what).level, -2.5);
  }
  const char* const errors[] = {
      "under_voltage", "over_voltage", "driver_temperature", "motor_temperature", "over_current",
      "short_circuit", "stall",        "lost_input"};
  for (std::size_t n = 0; n < std::size(errors); ++n) {
    const auto when =
        only_condition("when = { id = 2, error = \"" + std::string(errors[n]) + "\" }");
    EXPECT_EQ(std::get<ErrorSet>(when.what).error, static_cast<model::Error>(n));
  }
  const std::map<std::string, int> commands = {{"0xA4", 0xA4},     {"\"0xA4\"", 0xA4},
                                               {"\"0xa4\"", 0xA4}, {"\"0XA4\"", 0xA4},
                                               {"164", 164},       {"\"164\"", 164}};
  for (const auto& [text, byte] : commands) {
    const auto seen = std::get<CommandSeen>(
        only_condition("when = { id = 2, command = " + text + ", count = 3 }").what);
    EXPECT_EQ(seen.command, byte) << text;
    EXPECT_EQ(seen.count, 3);
  }
  EXPECT_EQ(std::get<CommandSeen>(only_condition("when = { id = 2, command = 1 }").what).count, 1);
}

TEST(Vocabulary, ConditionDefaultsToTheDriveOfItsEvent) {
  const auto own = events_of("id = 5\nwhen = { error = \"stall\" }\npower = \"off\"");
  ASSERT_EQ(own.size(), 1U);
  EXPECT_EQ(own[0].when->id, 5);
  EXPECT_EQ(own[0].at, 0s);
  const auto other =
      events_of("at_s = 2\nid = 5\nwhen = { id = 2, error = \"stall\" }\npower = \"off\"");
  EXPECT_EQ(other[0].when->id, 2);
  EXPECT_EQ(other[0].directive.id, 5);
  EXPECT_EQ(other[0].at, 2s);
}

TEST(Vocabulary, RejectsMalformedConditions) {
  const std::string place = "robot.toml:10: bus.event.when";
  const std::map<std::string, std::string> errors = {
      {"error = \"stall\"", place + ": needs the id of a drive"},
      {"id = 2", place + ": needs one of signal, error and command"},
      {"id = 3, error = \"stall\"", place + ".id: no drive 3 on this bus"},
      {"id = 2, signal = \"sped_dps\", above = 1",
       place + ".signal: \"sped_dps\" is unknown, did you mean speed_dps?"},
      {"id = 2, signal = \"speed_dps\"", place + ".signal: needs one of above, below and crosses"},
      {"id = 2, signal = \"speed_dps\", above = 1, below = 2",
       place + ".below: one of above, below and crosses is enough"},
      {R"(id = 2, signal = "speed_dps", error = "stall", above = 1)",
       place + ".id: one of signal, error and command is enough"},
      {"id = 2, error = \"stall\", count = 2", place + ".count: belongs to command"},
      {"id = 2, error = \"stall\", above = 2", place + ".above: unknown key"},
      {"id = 2, error = \"hot\"",
       place + ".error: \"hot\" is not one of under_voltage, over_voltage, driver_temperature, "
               "motor_temperature, over_current, short_circuit, stall, lost_input"},
      {"id = 2, command = 256", place + ".command: 256 is out of range (0 to 255)"},
      {"id = 2, command = \"A4\"",
       place + R"(.command: "A4" is not a command byte; write 0xA4 or "0xA4")"},
      {"id = 2, command = \"0x\"",
       place + R"(.command: "0x" is not a command byte; write 0xA4 or "0xA4")"},
      {"id = 2, command = \"0xA4 \"",
       place + R"(.command: "0xA4 " is not a command byte; write 0xA4 or "0xA4")"},
      {"id = 2, command = \"1A4\"",
       place + R"(.command: "1A4" is not a command byte; write 0xA4 or "0xA4")"},
      {"id = 2, command = \"0x1A4\"",
       place + R"(.command: "0x1A4" is not a command byte; write 0xA4 or "0xA4")"},
      {"id = 2, command = \"\"",
       place + R"(.command: "" is not a command byte; write 0xA4 or "0xA4")"},
      {"id = 2, command = 1, count = 0", place + ".count: 0 is out of range (1 to 1000000000)"},
  };
  for (const auto& [keys, error] : errors) {
    EXPECT_EQ(error_of("when = { " + keys + " }\npower = \"off\""), error) << keys;
  }
  EXPECT_EQ(error_of("when = \"now\"\npower = \"off\""), place + ": must be a table");
  EXPECT_EQ(error_of("power = \"off\""), "robot.toml:9: bus.event.at_s: missing");
  EXPECT_EQ(error_of("when = { id = 2, error = \"stall\" }"),
            place +
                ": an event needs an action: power, supply_V, sag_to_V, ambient_C, load, "
                "turn_deg, settings, fault, clear, push, payload, freeze, floor, pose or mark");
}

TEST(Vocabulary, LimitsFaultsAndConditionsOfABus) {
  const auto repeated = [](const std::string& keys, std::size_t times) {
    std::string text = keys;
    for (std::size_t n = 1; n < times; ++n) text += "\n[[bus.event]]\n" + keys;
    return text;
  };
  const std::string fault = "at_s = 1\nfault = \"hang\"";
  EXPECT_EQ(events_of(repeated(fault, Bus::kMaxFaults)).size(), Bus::kMaxFaults);
  EXPECT_EQ(error_of(repeated(fault, Bus::kMaxFaults + 1)),
            "robot.toml:3011: bus.event.fault: a bus keeps 1000 faults");
  const std::string when = "when = { id = 2, error = \"stall\" }\nmark = \"m\"";
  EXPECT_EQ(error_of(repeated(when, Bus::kMaxWaiting + 1)),
            "robot.toml:3010: bus.event.when: a bus keeps 1000 conditions");
}

// --- tables without text

std::vector<TimedDirective> read(const toml::table& table, Timing timing) {
  static const BusConfig bus = parse(kEventBus + "at_s = 0\nmark = \"x\"")[0];
  TableReader reader(table, "request", "");
  return read_directives(reader, bus, timing);
}

TEST(Vocabulary, ReadsTablesInMemory) {
  const toml::table request{
      {"ids", "2,5"}, {"fault", toml::table{{"kind", "jam"}, {"percent", 40}, {"for_s", 0.5}}}};
  const auto directives = read(request, Timing::kNow);
  ASSERT_EQ(directives.size(), 1U);
  const Fault& fault = std::get<SetFault>(directives[0].directive.what).fault;
  EXPECT_EQ(fault.row->word, "jam");
  EXPECT_EQ(fault.ids, (std::vector{2, 5}));
  EXPECT_EQ(fault.values[0], 40);
  EXPECT_EQ(fault.duration, 500ms);
  EXPECT_EQ(directives[0].at, 0s);
  EXPECT_FALSE(directives[0].when);

  const toml::table later{
      {"at_s", 2}, {"id", 5}, {"when", toml::table{{"command", "0x9C"}}}, {"power", "off"}};
  const auto planned = read(later, Timing::kOptional);
  ASSERT_EQ(planned.size(), 1U);
  EXPECT_EQ(planned[0].at, 2s);
  EXPECT_EQ(std::get<CommandSeen>(planned[0].when->what).command, 0x9C);
  EXPECT_EQ(read(toml::table{{"turn_deg", 3}}, Timing::kOptional).size(), 3U);
}

TEST(Vocabulary, ErrorsOfTablesInMemoryHaveNoLine) {
  const auto error = [](const toml::table& table, Timing timing) {
    return config_error([&] { read(table, timing); });
  };
  EXPECT_EQ(error(toml::table{{"id", 2}, {"fault", "jamm"}}, Timing::kNow),
            "request: fault: \"jamm\" is unknown, did you mean jam?");
  EXPECT_EQ(
      error(toml::table{{"fault", toml::table{{"kind", "sag"}, {"to_V", "12"}}}}, Timing::kNow),
      "request: fault.to_V: must be a number");
  EXPECT_EQ(error(toml::table{{"at_s", 1}, {"power", "off"}}, Timing::kNow),
            "request: at_s: unknown key");
  EXPECT_EQ(error(toml::table{{"power", "off"}}, Timing::kRequired), "request: at_s: missing");
  const std::string needs =
      "an event needs an action: power, supply_V, sag_to_V, ambient_C, load, turn_deg, settings, "
      "fault, clear, push, payload, freeze, floor, pose or mark";
  EXPECT_EQ(error(toml::table{}, Timing::kNow), "request: " + needs);
  EXPECT_EQ(error(toml::table{{"at_s", 1}}, Timing::kOptional), "request: at_s: " + needs);
}

TEST(Vocabulary, TableErrorsHavePathAndLine) {
  const toml::table document = parse_toml("seed = 1\n[a.b]\nc = 2\n", "robot.toml");
  TableReader top(document, "robot.toml", "");
  const TableReader inner = *top.table("a")->table("b");
  EXPECT_EQ(config_error([&] { inner.fail("", "is odd"); }), "robot.toml:2: a.b: is odd");
  EXPECT_EQ(config_error([&] { inner.fail("c", "is odd"); }), "robot.toml:3: a.b.c: is odd");
  EXPECT_EQ(config_error([&] { top.fail("", "is odd"); }), "robot.toml:1: is odd");
}

}  // namespace config_directives_test
}  // namespace lk::emulator
