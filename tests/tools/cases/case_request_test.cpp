// A case as a line of JSON: every key, with values that fit and values that do not.

#include "tools/cases/case_request.hpp"

#include <gtest/gtest.h>

#include "emulator/config/config_error.hpp"

namespace lk::emulator {
namespace case_request_test {

/// Returns the problem of the line; empty: none.
std::string problem_of(const std::string& text) {
  try {
    read_case(parse_json(text));
  } catch (const JsonError& problem) {
    return problem.where + ": " + problem.what();
  } catch (const ConfigError& problem) {
    return problem.what();
  }
  return "";
}

/// A case with one more key.
std::string with(const std::string& more) {
  return R"({"case": 7, "scenario": "joint_moves", )" + more + "}";
}

TEST(CaseRequest, ReadsEveryKey) {
  const CaseRequest request = read_case(parse_json(with(
      R"("seed": 3, "bitrate": 500000, "generation": "v236",
         "settings": {"supply_V": 20, "ambient_C": -5.5, "load": {"J_g_cm2": 9}, "bus_load": 0.25},
         "directives": [{"at_s": 1, "id": 1, "supply_V": 12}],
         "fault": {"at_s": 2, "id": 1, "fault": "jam"},
         "drive_errors": ["stall", "any"], "detect": [{"id": 1, "answered": {"within_s": 0.1}}])")));
  EXPECT_EQ(request.number, 7U);
  EXPECT_EQ(request.scenario, "joint_moves");
  EXPECT_EQ(request.keys["seed"].value<int>(), 3);
  EXPECT_EQ(request.keys["bitrate"].value<int>(), 500000);
  EXPECT_EQ(request.keys["generation"].value<std::string>(), "v236");
  EXPECT_EQ(request.settings.supply["supply_V"].value<double>(), 20);
  EXPECT_EQ(request.settings.ambient["ambient_C"].value<double>(), -5.5);
  EXPECT_EQ(request.settings.load["J_g_cm2"].value<double>(), 9);
  EXPECT_EQ(request.settings.bus_load, 0.25);
  EXPECT_EQ(request.directives.size(), 1U);
  EXPECT_EQ(request.fault->at_path("fault").value<std::string>(), "jam");
  EXPECT_EQ(request.drive_errors, (std::vector<std::string>{"stall", "any"}));
  EXPECT_EQ(request.detect.size(), 1U);
}

TEST(CaseRequest, NeedsNumberAndScenarioOnly) {
  const CaseRequest request = read_case(parse_json(R"({"case": 0, "scenario": "joint_moves"})"));
  EXPECT_EQ(request.number, 0U);
  EXPECT_TRUE(request.keys.empty());
  EXPECT_FALSE(request.fault);
  EXPECT_EQ(problem_of(R"({"scenario": "joint_moves"})"), "case: missing, or not a whole number");
  EXPECT_EQ(problem_of(R"({"case": 7})"), "case 7: scenario: missing");
}

TEST(CaseRequest, EmptyListsAndTablesChangeNothing) {
  const CaseRequest request = read_case(
      parse_json(with(R"("directives": [], "detect": [], "drive_errors": [], "settings": {})")));
  EXPECT_TRUE(request.directives.empty());
  EXPECT_TRUE(request.detect.empty());
  EXPECT_TRUE(request.drive_errors.empty());
  EXPECT_TRUE(request.settings.load.empty());
}

TEST(CaseRequest, RejectsNumbersThatDoublesCannotHold) {
  const auto number = [](const std::string& text) {
    return problem_of(R"({"scenario": "joint_moves", "case": )" + text + "}");
  };
  EXPECT_EQ(number("9007199254740992"), "");  // 2^53
  for (const char* text :
       {"9007199254740993", "-1", "9223372036854775808", "18446744073709551615"}) {
    EXPECT_EQ(number(text), "case: out of range (0 to 2^53)") << text;
  }
  for (const char* text : {"1.0", "1e3", "\"1\"", "null", "true", "[1]", "99999999999999999999"}) {
    EXPECT_EQ(number(text), "case: missing, or not a whole number") << text;
  }
}

TEST(CaseRequest, RejectsWrongTypesAndRanges) {
  const struct {
    const char* more;
    const char* problem;
  } kLines[] = {
      {R"("sead": 1)", "case 7: sead: unknown key, did you mean seed?"},
      {R"("settings": {"suply_V": 1})",
       "case 7: settings.suply_V: unknown key, did you mean supply_V?"},
      {R"("settings": {"load": {"J": 1}})", "case 7: settings.load.J: unknown key"},
      {R"("seed": -1)", "case 7: seed: -1 is out of range (0 to 9223372036854775807)"},
      {R"("seed": 1.5)", "case 7: seed: must be a whole number"},
      {R"("seed": 9223372036854775808)", "seed: the number is too large"},
      {R"("bitrate": "fast")", "case 7: bitrate: must be a whole number"},
      {R"("generation": 2)", "case 7: generation: must be a string"},
      {R"("settings": [])", "case 7: settings: must be a table"},
      {R"("settings": {"supply_V": 100.1})",
       "case 7: settings.supply_V: 100.1 is out of range (0 to 100)"},
      {R"("settings": {"ambient_C": -41})",
       "case 7: settings.ambient_C: -41 is out of range (-40 to 125)"},
      {R"("settings": {"bus_load": 0.96})",
       "case 7: settings.bus_load: 0.96 is out of range (0 to 0.95)"},
      {R"("settings": {"bus_load": "half"})", "case 7: settings.bus_load: must be a number"},
      {R"("settings": {"load": 1})", "case 7: settings.load: must be a table"},
      {R"("settings": {"load": {"J_g_cm2": -1}})",
       "case 7: settings.load.J_g_cm2: -1 is out of range"},
      {R"("directives": {})", "case 7: directives: must be an array of tables"},
      {R"("directives": [1])", "case 7: directives: must be an array of tables"},
      {R"("detect": "reply")", "case 7: detect: must be an array of tables"},
      {R"("drive_errors": "any")", "case 7: drive_errors: must be an array of strings"},
      {R"("drive_errors": [1])", "case 7: drive_errors: must be an array of strings"},
      {R"("fault": "jam")", "case 7: fault: must be a table"},
      {R"("fault": null)", "fault: null is not allowed; leave the key out"},
      {R"("fault": {"case": 1, "case": 2})", "case: is given twice"},
      {R"("case": 8)", "case: is given twice"},
  };
  for (const auto& line : kLines) {
    EXPECT_EQ(problem_of(with(line.more)).substr(0, std::string_view(line.problem).size()),
              line.problem)
        << line.more;
  }
  EXPECT_EQ(problem_of(R"({"case": 7, "scenario": 1})"), "case 7: scenario: must be a string");
  // A path ends at a NUL for the system, so another file would be read.
  EXPECT_EQ(problem_of(R"({"case": 7, "scenario": "./a.toml\u0000b"})"),
            "case 7: scenario: must be one line without control characters");
}

TEST(CaseRequest, RejectsAnythingButJsonObjects) {
  for (const char* text : {"[]", "1", "\"case\"", "null"}) {
    EXPECT_EQ(problem_of(text), "case: expected a JSON object") << text;
  }
  const std::string nul(1, '\0');
  for (const std::string& text :
       {std::string("{"), std::string("{}{}"), std::string("{\"case\": NaN}"), nul,
        with("\"seed\": 1" + nul), std::string("{\"case\xFF\": 1}"), std::string("// {}"),
        std::string("\xEF\xBB{}"), std::string("{\"a\": \"\\ud800\"}")}) {
    EXPECT_NE(problem_of(text).find("not JSON"), std::string::npos) << text;
  }
  const auto nested = [](std::size_t depth) {
    return with("\"detect\": " + std::string(depth, '[') + std::string(depth, ']'));
  };
  EXPECT_EQ(problem_of(nested(10)), "case 7: detect: must be an array of tables, [[detect]]");
  for (const std::size_t depth : {17U, 1000U, 500'000U}) {
    EXPECT_EQ(problem_of(nested(depth)), "body: is nested deeper than 16 levels") << depth;
  }
}

TEST(CaseRequest, ReadsManyPartsInLinearTime) {
  std::string list = "{}";
  for (int n = 0; n < 300'000; ++n) list += ",{}";
  EXPECT_EQ(problem_of(with("\"detect\": [" + list + "]")), "");
  std::string keys = "\"0\": 1";
  for (int n = 1; n < 100'000; ++n) keys += ",\"" + std::to_string(n) + "\": 1";
  EXPECT_EQ(problem_of(with(keys)), "998: is one of more than 1000 keys");
}

TEST(CaseRequest, GroupExcludesNumberAndFault) {
  const auto group = [](const std::string& more) {
    return read_case(parse_json(with(more))).group;
  };
  const std::string seed = group(R"("seed": 1)");
  EXPECT_EQ(group(R"("seed": 1, "fault": {"at_s": 1})"), seed);
  EXPECT_EQ(read_case(parse_json(R"({"case": 8, "scenario": "joint_moves", "seed": 1})")).group,
            seed);
  EXPECT_NE(group(R"("seed": 2)"), seed);
  EXPECT_NE(group(R"("seed": 1, "settings": {"supply_V": 20})"), seed);
  EXPECT_NE(group(R"("seed": 1, "detect": [{"id": 1}])"), seed);
}

}  // namespace case_request_test
}  // namespace lk::emulator
