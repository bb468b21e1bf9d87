// What lk-emu ctl makes of the answers of a running lk-emu (docs/openapi.json).

#include "tools/ctl/ctl_tables.hpp"

#include <gtest/gtest.h>

namespace lk::emulator {
namespace ctl_tables_test {

TEST(CtlTables, ARecordingIsSaidInWords) {
  const Json recording = {{"directory", "/tmp/run"}, {"replayable", false}, {"failed", false}};
  EXPECT_EQ(recording_line(recording), "recording into /tmp/run\n");
  EXPECT_EQ(recorded_line(recording), "recorded into /tmp/run\n");
  EXPECT_EQ(recorded_line({{"directory", "/tmp/run"}, {"failed", true}}),
            "recorded into /tmp/run, until the disk refused\n");
}

TEST(CtlTables, AScenarioThatHasBegunHasNoVerdictYet) {
  EXPECT_EQ(
      scenario_page({{"name", "arm"}, {"state", "running"}, {"time_s", 0.25}, {"duration_s", 5.0}}),
      "arm: running, 0.250 of 5 s\n");
}

TEST(CtlTables, AVerdictIsSaidLineByLine) {
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
