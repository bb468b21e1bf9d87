// Faults in configuration files, and their error messages.

#include <gtest/gtest.h>

#include <map>

#include "emulator/config/register_fields.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "tests/emulator/config/config_support.hpp"

namespace lk::emulator {
namespace config_faults_test {

using namespace std::chrono_literals;

/// Uses RS-485 drives for kinds of that wire.
Fault only_fault(const std::string& keys, const char* interface = "vcan0") {
  std::string text = kEventBus;
  text.replace(text.find("vcan0"), 5, interface);
  const auto events = parse(text + "at_s = 1\n" + keys)[0].events;
  EXPECT_EQ(events.size(), 1U) << keys;
  EXPECT_EQ(events[0].directive.id, kWholeBus);
  return std::get<SetFault>(events[0].directive.what).fault;
}

TEST(FaultVocabulary, ReadsEveryKindWithAllParameters) {
  for (const FaultRow& row : fault_table()) {
    std::string table = "{ kind = \"" + std::string(row.word) + R"(", name = "it")";
    FaultValues expected{};
    for (std::size_t n = 0; n < row.params.size() && !row.params[n].word.empty(); ++n) {
      const FaultParam& param = row.params[n];
      table += ", " + std::string(param.word) + " = ";
      if (param.choices.empty()) {
        const double most = param.word == "max_deg" ? 5 : param.max;  // its maximum is exclusive
        expected[n] = most;
        const auto whole = static_cast<long long>(most);
        table += static_cast<double>(whole) == most ? std::to_string(whole) : std::to_string(most);
      } else {  // the last choice
        expected[n] = static_cast<FaultChoice>(param.choices.size() - 1);
        table.append("\"").append(param.choices.back()).append("\"");
      }
    }
    if (row.per_frame) table += ", probability = 0.25";
    table +=
        row.momentary() ? ", every_s = 2, times = 3 }" : ", for_s = 0.5, every_s = 2, times = 3 }";
    // These drives have no gear play or brake, and the bus has no adapter.
    if (row.word == "backlash" || row.word == "brake_late" || row.word == "adapter_overrun") {
      continue;
    }
    const Fault fault = only_fault((row.of_bus ? "fault = " : "id = 5\nfault = ") + table,
                                   row.serial ? "rs485:/tmp/a" : "vcan0");
    EXPECT_EQ(fault.row, &row);
    EXPECT_EQ(fault.name, "it");
    EXPECT_EQ(fault.ids, row.of_bus ? std::vector<int>{} : std::vector{5}) << row.word;
    EXPECT_EQ(fault.values, expected) << row.word;
    EXPECT_EQ(fault.probability, row.per_frame ? 0.25 : 1.0);
    EXPECT_EQ(fault.duration, row.momentary() ? std::nullopt : std::optional<SimTime>(500ms));
    EXPECT_EQ(fault.every, 2s);
    EXPECT_EQ(fault.times, 3);
  }
}

TEST(FaultVocabulary, UsesDefaultsOfTheTable) {
  const Fault jam = only_fault("fault = \"jam\"");
  EXPECT_EQ(jam.row->word, "jam");
  EXPECT_EQ(jam.ids, (std::vector{2, 5, 7}));
  EXPECT_EQ(jam.values[0], FaultValue(100));
  EXPECT_EQ(jam.name, "");
  EXPECT_EQ(only_fault("fault = { kind = \"jam\", name = \"jam\" }").name, "jam");
  EXPECT_EQ(jam.duration, std::nullopt);
  EXPECT_EQ(jam.every, std::nullopt);
  EXPECT_EQ(jam.times, 0);
  EXPECT_EQ(only_fault("fault = { kind = \"reboot_loop\" }").values, (FaultValues{1000, 200, 0}));
  EXPECT_EQ(only_fault("fault = { kind = \"rom_damaged\" }").values[0],
            FaultValue(static_cast<RomParameter>(kRomParameters)));
  EXPECT_EQ(only_fault("ids = \"5,2\"\nfault = \"hang\"").ids, (std::vector{2, 5}));
}

TEST(FaultVocabulary, MemoryFaultChoicesMatchParameterOrder) {
  const std::map<std::string, RomParameter> words = {
      {"gains", RomParameter::kGains},
      {"acceleration", RomParameter::kAcceleration},
      {"encoder_offset", RomParameter::kEncoderOffset},
      {"max_torque_current", RomParameter::kMaxTorqueCurrent},
      {"max_power", RomParameter::kMaxPower},
      {"max_speed", RomParameter::kMaxSpeed},
      {"max_angle", RomParameter::kMaxAngle},
      {"current_ramp", RomParameter::kCurrentRamp},
      {"broadcast_mode", RomParameter::kBroadcastMode},
      {"protections", RomParameter::kProtections},
      {"align_value", RomParameter::kAlignValue},
      {"driver_id", RomParameter::kDriverId},
      {"bus_type", RomParameter::kBusType},
      {"rs485_rate", RomParameter::kSerialRate},
      {"can_rate", RomParameter::kCanRate}};
  for (const auto& [word, parameter] : words) {
    for (const std::string kind : {"rom_damaged", "ram_flipped"}) {
      if (kind == "ram_flipped" && parameter >= RomParameter::kProtections) continue;
      // This parameter limits MS drives only.
      if (kind == "ram_flipped" && parameter == RomParameter::kMaxPower) continue;
      const Fault fault =
          only_fault("id = 5\nfault = { kind = \"" + kind + "\", parameter = \"" + word + "\" }");
      EXPECT_EQ(fault.values[0], FaultValue(parameter)) << kind << ' ' << word;
    }
  }
}

TEST(FaultVocabulary, RejectsFaultsThatAreNormalBehaviour) {
  const auto drive = [](const std::string& quirk, const std::string& fault) {
    return "[[bus]]\ninterface = \"a\"\n[[bus.drive]]\nid = 1\n" + quirk +
           "\n[[bus.event]]\nat_s = 1\nfault = \"" + fault + "\"";
  };
  EXPECT_EQ(parse_error(drive("quirks.clear_reply = \"before\"", "clear_reply_before")),
            "robot.toml:8: bus.event.fault: clear_reply_before: drive 1 answers so anyway "
            "(quirks.clear_reply)");
  EXPECT_EQ(parse_error(drive("quirks.boot_multi_turn = \"zero\"", "multi_turn_zero_at_boot")),
            "robot.toml:8: bus.event.fault: multi_turn_zero_at_boot: drive 1 starts so anyway "
            "(quirks.boot_multi_turn)");
  EXPECT_EQ(parse_error(drive("quirks.off_hangs = \"drive\"", "bus_held_after_off")),
            "robot.toml:8: bus.event.fault: bus_held_after_off: drive 1 does so anyway "
            "(quirks.off_hangs)");
}

TEST(FaultVocabulary, RejectsRs485FaultsOnCan) {
  const auto bus = [](const std::string& name, const std::string& fault) {
    return "[[bus]]\ninterface = \"" + name +
           "\"\n[[bus.drive]]\nid = 1\n[[bus.event]]\nat_s = 1\n" + fault;
  };
  for (const char* fault : {"fault = \"echo\"", "fault = \"cr_to_lf\"", "fault = \"late_release\"",
                            "id = 1\nfault = \"checksum_bad\"", "id = 1\nfault = \"byte_lost\"",
                            "id = 1\nfault = \"byte_gap\""}) {
    EXPECT_EQ(parse(bus("rs485:/tmp/a", fault))[0].events.size(), 1U) << fault;
    EXPECT_NE(parse_error(bus("a", fault)).find(" belongs to RS-485, and this is a CAN bus"),
              std::string::npos)
        << fault;
  }
  EXPECT_EQ(parse_error(bus("rs485:/tmp/a", "id = 1\nfault = \"multi_turn_zero_at_boot\"")),
            "robot.toml:8: bus.event.fault: multi_turn_zero_at_boot: drive 1 starts so anyway "
            "(quirks.boot_multi_turn)");
}

TEST(FaultVocabulary, BacklashNeedsAGearWithPlay) {
  const auto geared = [](const std::string& mechanics) {
    return "[[bus]]\ninterface = \"a\"\n[[bus.drive]]\nid = 1\nmotor = \"mg4005\"\n"
           "profile.mechanics = { " +
           mechanics + " }\n[[bus.event]]\nat_s = 1\nfault = { kind = \"backlash\", factor = 3 }";
  };
  const auto events =
      parse(geared("backlash_arcmin = 10, gear_stiffness_Nm_rad = 500, "
                   "gear_damping_Nm_s_rad = 0.1, J_out_g_cm2 = 1000"))[0]
          .events;
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(std::get<SetFault>(events[0].directive.what).fault.values[0], FaultValue(3));
  // A rigid gear has no play, whatever its parameter.
  for (const char* none : {"backlash_arcmin = 10, gear_stiffness_Nm_rad = 0",
                           "backlash_arcmin = 0, gear_stiffness_Nm_rad = 500, "
                           "J_out_g_cm2 = 1000"}) {
    EXPECT_EQ(parse_error(geared(none)),
              "robot.toml:9: bus.event.fault: backlash: drive 1 has no gear with play")
        << none;
  }
}

TEST(FaultVocabulary, FlipsBitsOnlyInUsedParameters) {
  const auto flip = [](int id, const std::string& parameter) {
    return error_of("at_s = 1\nid = " + std::to_string(id) +
                    "\nfault = { kind = \"ram_flipped\", parameter = \"" + parameter + "\" }");
  };
  const std::string wrong = "robot.toml:12: bus.event.fault: ram_flipped: drive ";
  EXPECT_EQ(flip(5, "max_torque_current"), "accepted");
  EXPECT_EQ(flip(5, "max_power"),
            wrong + "5 is limited by max_torque_current, not by this parameter");
  EXPECT_EQ(flip(7, "max_power"), "accepted");
  EXPECT_EQ(flip(7, "max_torque_current"),
            wrong + "7 is limited by max_power, not by this parameter");
}

TEST(FaultVocabulary, AcceptsOneSidedEndStops) {
  const auto sides = [](const std::string& keys) {
    const Fault fault = only_fault("id = 5\nfault = { kind = \"end_stop\", " + keys + " }");
    return std::pair(fault.values[0].number(), fault.values[1].number());
  };
  EXPECT_EQ(sides("min_deg = -10"), std::pair(-10.0, 1e6));
  EXPECT_EQ(sides("max_deg = 20"), std::pair(-1e6, 20.0));
  EXPECT_EQ(sides("min_deg = 0, max_deg = 0"), std::pair(0.0, 0.0));
}

TEST(FaultVocabulary, RejectsMalformedFaults) {
  const std::string wrong = "robot.toml:11: bus.event.fault";
  const std::map<std::string, std::string> errors = {
      {"fault = \"jamm\"", wrong + ": \"jamm\" is unknown, did you mean jam?"},
      {"fault = { kind = \"encoder_stuk\" }",
       wrong + ".kind: \"encoder_stuk\" is unknown, did you mean encoder_stuck?"},
      {"fault = { kind = \"qqqqqqqq\" }", wrong + ".kind: \"qqqqqqqq\" is unknown"},
      {"fault = {}", wrong + ".kind: missing"},
      {"fault = { kid = \"jam\" }", wrong + ".kid: unknown key, did you mean kind?"},
      {"fault = 3", wrong + ": must be a table"},
      {"fault = \"end_stop\"", wrong + ": end_stop needs min_deg or max_deg"},
      {"fault = { kind = \"end_stop\", for_s = 1 }", wrong + ": end_stop needs min_deg or max_deg"},
      {"fault = \"sag\"", wrong + ": needs to_V: { kind = \"sag\", to_V = … }"},
      {"fault = { kind = \"sag\" }", wrong + ".to_V: missing"},
      {"fault = { kind = \"sag\", to_v = 3 }", wrong + ".to_v: unknown key, did you mean to_V?"},
      {"fault = { kind = \"sag\", to_V = 101 }", wrong + ".to_V: 101 is out of range (0 to 100)"},
      {"fault = { kind = \"sag\", to_V = nan }", wrong + ".to_V: nan is out of range (0 to 100)"},
      {R"(fault = { kind = "phase_open", phase = "d" })",
       wrong + ".phase: \"d\" is not one of a, b, c"},
      {R"(fault = { kind = "phase_open", side = "high" })", wrong + ".side: unknown key"},
      {"fault = { kind = \"jam\", probability = 0.5 }",
       wrong + ".probability: jam does not act on frames"},
      {"fault = { kind = \"drop\", probability = 1.5 }",
       wrong + ".probability: 1.5 is out of range (0 to 1)"},
      {"fault = { kind = \"reset\", for_s = 1 }",
       wrong + ".for_s: reset is instantaneous; remove this key"},
      {"fault = { kind = \"jam\", for_s = 0 }",
       wrong + ".for_s: must be above 0; leave it out for a fault that stays"},
      {"fault = { kind = \"jam\", for_s = 1e-10 }",
       wrong + ".for_s: must be above 0; leave it out for a fault that stays"},
      {"fault = { kind = \"jam\", for_s = -1 }",
       wrong + ".for_s: -1 is out of range (0 to 100000000)"},
      {"fault = { kind = \"jam\", every_s = 1 }",
       wrong + ".every_s: needs for_s: how long it lasts each time"},
      {"fault = { kind = \"jam\", for_s = 1, every_s = 1 }",
       wrong + ".every_s: must be longer than it lasts each time"},
      {"fault = { kind = \"reset\", every_s = 0.0001 }",
       wrong + ".every_s: must be at least 0.001"},
      {"fault = { kind = \"reset\", every_s = 0 }", wrong + ".every_s: must be at least 0.001"},
      {"fault = { kind = \"jam\", for_s = 1, times = 3 }", wrong + ".times: belongs to every_s"},
      {"fault = { kind = \"jam\", for_s = 1, every_s = 2, times = 0 }",
       wrong + ".times: 0 is out of range (1 to 1000000000)"},
      {"fault = { kind = \"jam\", for_s = 1, every_s = 2, times = 1.5 }",
       wrong + ".times: must be a whole number"},
      {"fault = { kind = \"wrong_dlc\", dlc = 2.5 }", wrong + ".dlc: must be a whole number"},
      {R"(fault = { kind = "jam", name = "all" })",
       wrong + ".name: \"all\" is reserved: it means all faults"},
      {R"(fault = { kind = "jam", name = "hang" })",
       wrong + ".name: is the name of another kind of fault"},
      {R"(fault = { kind = "jam", name = ")" + std::string(65, 'x') + "\" }",
       wrong + ".name: is longer than 64 bytes"},
      {R"(fault = { kind = "jam", name = "a\nb" })",
       wrong + ".name: must be one line without control characters"},
      {R"(fault = { kind = "jam", name = "a\u007Fb" })",
       wrong + ".name: must be one line without control characters"},
      {"ids = \"2,7\"\nfault = { kind = \"current_gain\", gain = 2 }",
       "robot.toml:12: bus.event.fault: current_gain: drive 7 has no current sensors (MS series)"},
      {"id = 7\nfault = \"current_stuck\"",
       "robot.toml:12: bus.event.fault: current_stuck: drive 7 has no current sensors (MS series)"},
      {"id = 2\nfault = { kind = \"backlash\", factor = 2 }",
       "robot.toml:12: bus.event.fault: backlash: drive 2 has no gear with play"},
      {"id = 2\nfault = \"brake_late\"",
       "robot.toml:12: bus.event.fault: brake_late: drive 2 has no brake"},
      {"id = 2\nfault = \"error_frames\"",
       "robot.toml:11: bus.event.id: error_frames acts on the whole bus; remove this key"},
      {"ids = \"2,5\"\nfault = \"error_frames\"",
       "robot.toml:11: bus.event.ids: error_frames acts on the whole bus; remove this key"},
      {"id = 3\nfault = \"jam\"", "robot.toml:11: bus.event.id: no drive 3 on this bus"},
  };
  for (const auto& [keys, error] : errors) EXPECT_EQ(error_of("at_s = 1\n" + keys), error) << keys;
}

}  // namespace config_faults_test
}  // namespace lk::emulator
