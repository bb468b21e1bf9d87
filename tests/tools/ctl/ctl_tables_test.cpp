// Tables of lk-emu ctl from answers of a running lk-emu (docs/openapi.json).

#include "tools/ctl/ctl_tables.hpp"

#include <gtest/gtest.h>

namespace lk::emulator {
namespace ctl_tables_test {

TEST(CtlTables, DescribeARecording) {
  const Json recording = {{"directory", "/tmp/run"}, {"replayable", false}, {"failed", false}};
  EXPECT_EQ(recording_line(recording), "recording into /tmp/run\n");
  EXPECT_EQ(recorded_line(recording), "recorded into /tmp/run\n");
  EXPECT_EQ(recorded_line({{"directory", "/tmp/run"}, {"failed", true}}),
            "recorded into /tmp/run, until the disk refused\n");
}

/// Texts are aligned left and numbers right, as the column heads.
TEST(CtlTables, FitColumnsToTheirContents) {
  const auto bus = [](const char* name, double frames) {
    return Json{{"bus", name},
                {"ids", {1, 2}},
                {"up", true},
                {"counters", {{"frames", frames}, {"queries", 3}, {"replies", 3}}}};
  };
  const Json status = {{"version", "0.2.0"},
                       {"pid", 7},
                       {"clock", {{"mode", "stepped"}, {"time_s", 0}, {"slipped_s", 0}}},
                       {"buses", {bus("vcan0", 3), bus("udp-multicast:239.74.163.2", 123456789)}}};
  EXPECT_EQ(status_table(status),
            "lk-emu 0.2.0, pid 7\n"
            "clock: stepped, 0.000000 s, slipped 0.000 s\n"
            "bus                         ids  up      frames  queries  replies  lost  waiting\n"
            "vcan0                       1,2  yes          3        3        3     0        0\n"
            "udp-multicast:239.74.163.2  1,2  yes  123456789        3        3     0        0\n");
  const auto drive = [](const char* on, const char* motor, Json errors) {
    return Json{{"bus", on},
                {"id", 1},
                {"motor", motor},
                {"state", "running"},
                {"alive", true},
                {"errors", std::move(errors)},
                {"signals", {{"angle_deg", 12.5}, {"voltage_V", 24.0}, {"temperature_C", 25.0}}}};
  };
  EXPECT_EQ(drives_table({drive("slcan-tcp:29536", "mg4005-14p", Json::array()),
                          drive("vcan0", "mf7015", {"stall"})}),
            "bus              id  motor       state     angle_deg  speed_dps     iq_A     V     C  "
            "errors\n"
            "slcan-tcp:29536   1  mg4005-14p  running       12.50        0.0    0.000  24.0  25.0  "
            "-\n"
            "vcan0             1  mf7015      running       12.50        0.0    0.000  24.0  25.0  "
            "stall\n");
}

TEST(CtlTables, ShowNoVerdictOfARunningScenario) {
  EXPECT_EQ(
      scenario_page({{"name", "arm"}, {"state", "running"}, {"time_s", 0.25}, {"duration_s", 5.0}}),
      "arm: running, 0.250 of 5 s\n");
}

TEST(CtlTables, ShowOneLinePerExpectation) {
  const Json scenario = {
      {"name", "arm"},
      {"state", "invalid"},
      {"time_s", 5.0},
      {"duration_s", 5.0},
      {"expectations",
       {{{"status", "passed"}, {"expected", "A"}, {"measured", "a"}, {"says", "why"}},
        {{"status", "failed"}, {"expected", "B"}, {"measured", "b"}, {"says", ""}}}},
      {"faults", {{{"evidence", "vcan0 jam never began"}}}},
      {"invalid", {"vcan0: cut short"}}};
  EXPECT_EQ(scenario_page(scenario),
            "arm: invalid, 5.000 of 5 s\n"
            "  passed  A - a\n"
            "          why\n"
            "  failed  B - b\n"
            "  fault   vcan0 jam never began\n"
            "  invalid: vcan0: cut short\n");
}

}  // namespace ctl_tables_test
}  // namespace lk::emulator
