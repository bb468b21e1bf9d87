// Events in a configuration file.

#include <gtest/gtest.h>

#include <map>
#include <numbers>

#include "tests/emulator/config/config_support.hpp"

namespace lk::emulator {
namespace config_events_test {

using std::chrono::milliseconds;

// The next line has number 7.
const std::string kBus =
    "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nids = \"2,5\"\nprofile.supply.v_source_V = "
    "30\n[[bus.event]]\n";

std::vector<TimedDirective> events_of(const std::string& keys) {
  return parse(kBus + keys)[0].events;
}

/// Returns the only directive, of this kind, at 1 s, for drive 5.
template <typename What>
What only(const std::string& action) {
  const auto events = events_of("at_s = 1\nid = 5\n" + action);
  EXPECT_EQ(events.size(), 1U) << action;
  EXPECT_EQ(events[0].at, milliseconds(1000));
  EXPECT_EQ(events[0].directive.id, 5);
  return std::get<What>(events[0].directive.what);
}

TEST(ConfigEvents, ReadEveryAction) {
  only<PowerOn>("power = \"on\"");
  only<PowerOff>("power = \"off\"");
  EXPECT_EQ(only<PowerCycle>("power = \"cycle\"").off_for, PowerCycle{}.off_for);
  EXPECT_EQ(only<PowerCycle>("power = \"cycle\"\noff_s = 2.5").off_for, milliseconds(2500));
  EXPECT_EQ(only<SupplyVoltage>("supply_V = 9.5").supply_V, 9.5);
  EXPECT_EQ(only<SupplyVoltage>("supply_V = 9.5").ramp, SimTime(0));
  EXPECT_EQ(only<SupplyVoltage>("supply_V = 9.5\nramp_s = 0.1").ramp, milliseconds(100));
  EXPECT_EQ(only<Sag>("sag_to_V = 8\nsag_s = 0.25").to_V, 8);
  EXPECT_EQ(only<Sag>("sag_to_V = 8\nsag_s = 0.25").duration, milliseconds(250));
  EXPECT_EQ(only<AmbientTemperature>("ambient_C = -10").ambient_C, -10);
  EXPECT_EQ(only<TurnShaft>("turn_deg = -3.5").turn_deg, -3.5);
  const model::LoadParams load = only<Load>("load = { J_g_cm2 = 10, theta_max_deg = 90 }").load;
  EXPECT_DOUBLE_EQ(load.J, 1e-6);
  EXPECT_DOUBLE_EQ(load.theta_max, std::numbers::pi / 2);
  EXPECT_EQ(load.theta_min, model::LoadParams{}.theta_min);
}

TEST(ConfigEvents, ApplyToAllDrivesByDefault) {
  const auto all = events_of("at_s = 0\nambient_C = 0");
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].directive.id, 2);
  EXPECT_EQ(all[1].directive.id, 5);
  EXPECT_EQ(events_of("at_s = 0\nids = \"2,5\"\nambient_C = 0").size(), 2U);
  EXPECT_EQ(events_of("at_s = 0\nid = 2\nambient_C = 0").size(), 1U);
  EXPECT_TRUE(parse("[[bus]]\ninterface = \"a\"\n[[bus.drive]]\nid = 1")[0].events.empty());
}

TEST(ConfigEvents, AreSortedByTimeAndThenAsWritten) {
  const auto events = events_of(
      "at_s = 2\nid = 2\nambient_C = 1\n"
      "[[bus.event]]\nat_s = 1\nid = 2\nsag_to_V = 8\nsag_s = 1\n"
      "[[bus.event]]\nat_s = 2\nid = 2\nambient_C = 3\n");
  ASSERT_EQ(events.size(), 3U);
  EXPECT_TRUE(std::holds_alternative<Sag>(events[0].directive.what));
  EXPECT_EQ(std::get<AmbientTemperature>(events[1].directive.what).ambient_C, 1);
  EXPECT_EQ(std::get<AmbientTemperature>(events[2].directive.what).ambient_C, 3);
}

TEST(ConfigEvents, ApplyToTheSelectedDrivesOnly) {
  Overrides overrides;
  overrides.buses.push_back({"vcan0", std::vector{5, 6}});
  const auto bus = parse(kBus + "at_s = 1\nambient_C = 1", overrides)[0];
  ASSERT_EQ(bus.events.size(), 1U);
  EXPECT_EQ(bus.events[0].directive.id, 5);
}

TEST(ConfigEvents, OmitFaultsAndConditionsOfOmittedDrives) {
  Overrides overrides;
  overrides.buses.push_back({"vcan0", std::vector{5, 6}});
  const auto bus = parse(
      kBus +
          "at_s = 1\nfault = { kind = \"jam\", name = \"of both\" }\n"
          "[[bus.event]]\nat_s = 2\nid = 2\nfault = { kind = \"jam\", name = \"gone\" }\n"
          "[[bus.event]]\nat_s = 3\nfault = { kind = \"error_frames\", name = \"of the bus\" }\n"
          "[[bus.event]]\nat_s = 4\nmark = \"now\"\n"
          "[[bus.event]]\nat_s = 5\nwhen = { id = 2, error = \"stall\" }\nmark = \"never\"\n"
          "[[bus.event]]\nat_s = 6\nwhen = { id = 5, error = \"stall\" }\nmark = \"perhaps\"\n"
          "[[bus.event]]\nat_s = 7\nid = 2\nwhen = { id = 5, error = \"stall\" }\npower = "
          "\"off\"\n",
      overrides)[0];
  ASSERT_EQ(bus.events.size(), 4U);
  const auto fault = [&](std::size_t n) {
    return std::get<SetFault>(bus.events[n].directive.what).fault;
  };
  EXPECT_EQ(fault(0).name, "of both");
  EXPECT_EQ(fault(0).ids, std::vector{5});
  EXPECT_EQ(fault(1).name, "of the bus");
  EXPECT_EQ(std::get<Mark>(bus.events[2].directive.what).text, "now");
  EXPECT_EQ(std::get<Mark>(bus.events[3].directive.what).text, "perhaps");
}

/// Without an adapter no frames wait in one.
TEST(ConfigEvents, OverrunNeedsAnAdapter) {
  const auto error = [](const std::string& keys, const std::string& events) {
    return config_error([&] {
      parse("[[bus]]\ninterface = \"vcan0\"\n" + keys + "[[bus.drive]]\nid = 1\n" + events);
    });
  };
  const std::string overrun = "[[bus.event]]\nat_s = 1\nfault = \"adapter_overrun\"\n";
  const std::string batch = "[[bus.event]]\nat_s = 2\nfault = \"adapter_batch\"\n";
  EXPECT_EQ(error("", overrun),
            "robot.toml:7: bus.event.fault: adapter_overrun: this bus has no adapter that delays "
            "frames; give the bus an `adapter`, or add adapter_latency or adapter_batch first");
  EXPECT_EQ(error("adapter = \"ftdi_default\"\n", overrun), "accepted");
  EXPECT_EQ(error("", overrun + batch), "accepted");
}

TEST(ConfigEvents, ErrorsNameFileLineKeyAndReason) {
  const std::map<std::string, std::string> errors = {
      {"ambient_C = 1", "robot.toml:6: bus.event.at_s: missing"},
      {"at_s = -1\nambient_C = 1",
       "robot.toml:7: bus.event.at_s: -1 is out of range (0 to 100000000)"},
      {"at_s = 1",
       "robot.toml:7: bus.event.at_s: an event needs an action: power, supply_V, sag_to_V, "
       "ambient_C, load, turn_deg, settings, fault, clear, push, payload, freeze, floor, pose or "
       "mark"},
      {"at_s = 1\nclock = \"x10\"",
       "robot.toml:8: bus.event.clock: time is the running program's: --clock, or lk-emu ctl "
       "clock"},
      {"at_s = 1\nturn_deg = 1\nambient_C = 1",
       "robot.toml:8: bus.event.turn_deg: only one action per event; this event has ambient_C "
       "already"},
      {"at_s = 1\nid = 3\nambient_C = 1", "robot.toml:8: bus.event.id: no drive 3 on this bus"},
      {"at_s = 1\nids = \"2-5\"\nambient_C = 1",
       "robot.toml:8: bus.event.ids: no drive 3 on this bus"},
      {"at_s = 1\nid = 2\nids = \"2\"\nambient_C = 1",
       "robot.toml:9: bus.event.ids: give either id or ids"},
      {"at_s = 1\npower = \"out\"",
       "robot.toml:8: bus.event.power: \"out\" is not one of on, off, cycle"},
      {"at_s = 1\npower = \"off\"\noff_s = 1",
       "robot.toml:9: bus.event.off_s: belongs to power = \"cycle\""},
      {"at_s = 1\nambient_C = 1\noff_s = 1",
       "robot.toml:9: bus.event.off_s: belongs to power = \"cycle\""},
      {"at_s = 1\nsag_to_V = 1\nsag_s = 1\nramp_s = 1",
       "robot.toml:10: bus.event.ramp_s: belongs to supply_V"},
      {"at_s = 1\nsupply_V = 1\nsag_s = 1", "robot.toml:9: bus.event.sag_s: belongs to sag_to_V"},
      {"at_s = 1\nsag_to_V = 1", "robot.toml:6: bus.event.sag_s: missing"},
      {"at_s = 1\nsupply_V = 101",
       "robot.toml:8: bus.event.supply_V: 101 is out of range (0 to 100)"},
      {"at_s = 1\nload = 1", "robot.toml:8: bus.event.load: must be a table"},
      {"at_s = 1\nload = { theta_min_deg = 2, theta_max_deg = 1 }",
       "robot.toml:8: bus.event.load.theta_min_deg: must not be above theta_max_deg"},
      {"at_s = 1\nsuply_V = 1",
       "robot.toml:8: bus.event.suply_V: unknown key, did you mean supply_V?"},
      {"at_s = 1\nramp_s = 1\nsuply_V = 1",
       "robot.toml:9: bus.event.suply_V: unknown key, did you mean supply_V?"},
      {"at_s = 1\nfalt = \"jam\"",
       "robot.toml:8: bus.event.falt: unknown key, did you mean fault?"},
  };
  for (const auto& [keys, error] : errors) EXPECT_EQ(parse_error(kBus + keys), error) << keys;
}

}  // namespace config_events_test
}  // namespace lk::emulator
