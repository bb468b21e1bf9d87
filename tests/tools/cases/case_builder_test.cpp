// From a requested case to a scenario: changes that apply, and cases that are impossible.

#include "tools/cases/case_builder.hpp"

#include <gtest/gtest.h>

#include "tests/tools/cases/cases_support.hpp"
#include "tools/cases/case_batch.hpp"

namespace lk::test {
namespace case_builder_test {

class CaseBuilder : public Cases {
 protected:
  std::string error_of(const Json& more, const std::string& scenario = "move.toml") const {
    return result(one(1, more, scenario)).value("error", "");
  }
  std::string replies_of(const Json& more) const {
    const Json answer = result(one(1, more));
    EXPECT_TRUE(answer.contains("replies")) << answer;
    return answer.value("replies", "");
  }
  Json room_for(int faults) const {
    Json directives = Json::array();
    for (int n = 0; n < faults; ++n) directives.push_back({{"at_s", 0}, {"fault", "echo"}});
    return directives;
  }
};

TEST_F(CaseBuilder, EverySettingChangesTheReplies) {
  const std::string plain = replies_of(Json::object());
  EXPECT_EQ(replies_of(Json::object()), plain);
  for (const Json& more : {
           Json{{"seed", 2}},
           Json{{"bitrate", 250000}},
           Json{{"generation", "v235"}},
           Json{{"settings", {{"supply_V", 6}}}},
           Json{{"settings", {{"ambient_C", 80}}}},
           Json{{"settings", {{"load", {{"J_g_cm2", 50000}}}}}},
           Json{{"settings", {{"bus_load", 0.9}}}},
           Json{{"directives", Json::array({{{"at_s", 0.1}, {"id", 1}, {"power", "off"}}})}},
           fault(0.1, {{"kind", "jam"}}),
       }) {
    EXPECT_NE(replies_of(more), plain) << more;
  }
}

TEST_F(CaseBuilder, KeepsOtherKeysOfTheLoad) {
  const std::string robot = text_of("can.toml");
  put("can.toml", robot + "load = { J_g_cm2 = 800, tau_Nm = 0.25 }\n");
  const std::string changed = replies_of({{"settings", {{"load", {{"J_g_cm2", 5000}}}}}});
  put("can.toml", robot + "load = { J_g_cm2 = 5000, tau_Nm = 0.25 }\n");
  EXPECT_EQ(replies_of(Json::object()), changed);
  put("can.toml", robot + "load = { J_g_cm2 = 5000 }\n");
  EXPECT_NE(replies_of(Json::object()), changed);
}

TEST_F(CaseBuilder, ReportsReasonsForImpossibleCases) {
  EXPECT_EQ(error_of({{"scenario", path("none.toml")}}),
            "cannot read " + path("none.toml") + ": No such file or directory");
  EXPECT_EQ(error_of({{"scenario", "joint_move"}})
                .find("no scenario \"joint_move\", did you mean joint_moves?"),
            0U);
  EXPECT_EQ(error_of({{"scenario", path("")}}), path("") + ": is a directory");
  const struct {
    Json more;
    std::string problem;
  } kCases[] = {
      {{{"bitrate", 123}}, ": bitrate: "},
      {{{"generation", "v1"}}, ": generation: \"v1\" is not one of "},
      {{{"drive_errors", Json::array({"stal"})}}, "case 1: detect.error: \"stal\" is not one of "},
      {{{"detect", Json::array({Json::object()})}}, "case 1: detect"},
      {{{"detect", Json::array({{{"id", 3}, {"answered", {{"within_s", 1}}}}})}},
       "case 1: detect.id: no drive 3"},
      {{{"directives", Json::array({Json::object()})}}, ": event.at_s: missing"},
      {{{"directives", Json::array({{{"at_s", 0.3}, {"id", 1}, {"power", "off"}}})}},
       ": event.at_s: is after the end of the scenario, 0.25 s"},
      {{{"fault", Json::object()}}, "case 1: fault.at_s: missing"},
      {{{"fault", {{"at_s", 0.1}, {"id", 1}}}}, "case 1: fault.at_s: an event needs an action: "},
      {{{"fault", {{"at_s", 0.1}, {"id", 1}, {"supply_V", 9}}}}, "case 1: fault: is not a fault"},
      {{{"fault", {{"at_s", 0.1}, {"idd", 1}, {"fault", "jam"}}}},
       "case 1: fault.idd: unknown key"},
      {{{"fault", {{"fault", "jam"}, {"when", {{"id", 1}, {"command", 0x9C}}}}}},
       "case 1: fault.when: not allowed: a case's fault begins at at_s; move this event to "
       "directives"},
      {fault(0.26, {{"kind", "jam"}}), "case 1: fault.at_s: is after the end of the scenario"},
      {fault(0.1, {{"kind", "jamm"}}),
       "case 1: fault.fault.kind: \"jamm\" is unknown, did you mean jam?"},
      {fault(0.1, {{"kind", "jam"}, {"percent", 101}}),
       "case 1: fault.fault.percent: 101 is out of range"},
      {{{"fault", {{"at_s", 0.1}, {"id", 4'294'967'297}, {"fault", "jam"}}}}, "case 1: fault.id: "},
      {fault(0.1, {{"kind", "echo"}}), "case 1: fault"},  // of RS-485
  };
  for (const auto& one : kCases) {
    EXPECT_NE(error_of(one.more).find(one.problem), std::string::npos)
        << one.more << ": " << error_of(one.more);
  }
  EXPECT_EQ(error_of({{"settings", {{"bus_load", 0.5}}}}, "serial.toml"),
            "case 1: settings.bus_load: needs a CAN bus with a bitrate");
}

TEST_F(CaseBuilder, LimitsFaultsOfABus) {
  const Json one_more{{"at_s", 0.1}, {"fault", "cr_to_lf"}};
  EXPECT_EQ(error_of({{"directives", room_for(999)}, {"fault", one_more}}, "serial.toml"), "");
  EXPECT_EQ(error_of({{"directives", room_for(1000)}, {"fault", one_more}}, "serial.toml"),
            "case 1: fault.fault: a bus keeps 1000 faults");
}

TEST(CaseJson, ErrorsAreUtf8ForAnyFileName) {
  EXPECT_EQ(emulator::impossible_json(1, "caf\xE9: is a directory"),
            "{\"case\":1,\"error\":\"caf?: is a directory\"}\n");
}

TEST_F(CaseBuilder, WritesAScenarioForAnyDirectory) {
  Json more = fault(0.1, {{"kind", "silent"}});
  more["drive_errors"] = {"any"};
  const emulator::CaseRequest request = emulator::read_case(one(1, more));
  const std::string text = emulator::CaseBuilder().file_text(request);
  EXPECT_NE(text.find("robot = \"" + path("can.toml") + "\""), std::string::npos) << text;
  EXPECT_NE(text.find("error = \"any\""), std::string::npos) << text;
  EXPECT_NE(text.find("silent"), std::string::npos) << text;
}

}  // namespace case_builder_test
}  // namespace lk::test
