// Lines in, lines out: jobs, blank lines, files that are no cases, one case as a scenario.

#include "tools/cases/case_stream.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "emulator/core/start_error.hpp"
#include "tests/tools/cases/cases_support.hpp"

namespace lk::test {
namespace case_stream_test {

struct Outcome {
  bool all_possible = true;
  std::string problem;  // of a StartError
  std::string out;
};

std::vector<std::string> sorted_lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  std::ranges::sort(lines);
  return lines;
}

class CaseStream : public Cases {
 protected:
  Outcome run(const std::string& text, emulator::CaseInput options = {}) const {
    options.file = put("cases", text);
    return run_file(options);
  }
  static Outcome run_file(const emulator::CaseInput& options) {
    Outcome outcome;
    testing::internal::CaptureStdout();
    try {
      outcome.all_possible = emulator::run_cases(options);
    } catch (const emulator::StartError& problem) {
      outcome.problem = problem.what();
    }
    outcome.out = testing::internal::GetCapturedStdout();
    return outcome;
  }
  std::string lines_of(std::uint64_t count) const {
    std::string text;
    for (std::uint64_t n = 0; n < count; ++n) {
      text +=
          one(n, fault(0.001 * static_cast<double>(n % 200), {{"kind", "silent"}})).dump() + '\n';
    }
    return text;
  }
  /// Where the input is refused, without the name of the file.
  std::string place(const Outcome& outcome) const {
    const std::string file = "--cases: " + path("cases") + ":";
    EXPECT_EQ(outcome.problem.find(file), 0U) << outcome.problem;
    return outcome.problem.substr(std::min(file.size(), outcome.problem.size()));
  }
};

TEST_F(CaseStream, JobsGiveTheSameResults) {
  const std::string text = lines_of(300);  // more than two piles
  const auto first = sorted_lines(run(text).out);
  EXPECT_EQ(first.size(), 300U);
  for (const int jobs : {2, 4}) EXPECT_EQ(sorted_lines(run(text, {.jobs = jobs}).out), first);
}

TEST_F(CaseStream, BlankLinesOnlyEndBatches) {
  const std::string one_line = one(1).dump();
  const std::string text =
      "\n\r\n \t\n" + one_line + "\n\n\n" + one(2).dump() + "\r\n\n" + one(3).dump();
  const Outcome outcome = run(text);
  EXPECT_TRUE(outcome.all_possible) << outcome.problem;
  ASSERT_EQ(sorted_lines(outcome.out).size(), 3U);
  EXPECT_NE(outcome.out.find(one_line.substr(1, 8)), std::string::npos);
  EXPECT_EQ(run("\n\n").out, "");
  EXPECT_EQ(run("").out, "");
}

TEST_F(CaseStream, MalformedLineEndsTheProgram) {
  const std::string good = one(1).dump() + '\n';
  EXPECT_EQ(place(run(good + "{\"case\": 2,\n")).find("2: byte 12: not JSON: "), 0U);
  EXPECT_EQ(place(run("\n\n[]\n" + good)), "3: case: expected a JSON object");
  EXPECT_EQ(place(run(good + "{\"case\": -1}")), "2: case: out of range (0 to 2^53)");
  EXPECT_EQ(place(run(std::string("\0\n", 2))).find("1: byte 1: not JSON: "), 0U);
  EXPECT_EQ(place(run(good + std::string(3'000'000, 'x'))), "2: is longer than 1 MB");
  for (const int jobs : {1, 4}) {
    EXPECT_EQ(place(run(lines_of(200) + "x\n", {.jobs = jobs})).find("201: byte 1: not JSON: "),
              0U);
  }
}

TEST_F(CaseStream, ImpossibleCaseDoesNotStopOthers) {
  const std::string text = one(1).dump() + '\n' + R"({"case": 2})" + '\n' +
                           one(3, {{"sead", 1}}).dump() + '\n' + one(4).dump() + '\n';
  for (const bool check : {false, true}) {
    const Outcome outcome = run(text, {.check = check});
    EXPECT_EQ(outcome.problem, "");
    EXPECT_FALSE(outcome.all_possible);
    const auto lines = sorted_lines(outcome.out);
    ASSERT_EQ(lines.size(), 4U);
    EXPECT_EQ(lines[1], R"({"case":2,"error":"case 2: scenario: missing"})");
    EXPECT_EQ(lines[2], R"({"case":3,"error":"case 3: sead: unknown key, did you mean seed?"})");
  }
}

TEST_F(CaseStream, RejectsUnreadableInput) {
  EXPECT_EQ(run_file({.file = path("none")}).problem, "--cases: cannot read " + path("none"));
  EXPECT_EQ(run_file({.file = path("")}).problem, "--cases: cannot read " + path(""));
}

TEST_F(CaseStream, WritesTheOnlyCaseAsAScenario) {
  const std::string file = path("case.toml");
  const emulator::CaseInput options{.scenario = file};
  const Outcome outcome = run(one(1, fault(0.1, {{"kind", "jam"}})).dump(), options);
  EXPECT_EQ(outcome.problem, "");
  EXPECT_EQ(outcome.out, "");
  EXPECT_NE(text_of("case.toml").find("jam"), std::string::npos);
  EXPECT_EQ(run("", options).problem, "--scenario: needs exactly one case");
  EXPECT_EQ(run(one(1).dump() + '\n' + one(2).dump(), options).problem,
            "--scenario: needs exactly one case");
}

TEST_F(CaseStream, WritesNoScenarioForAnImpossibleCase) {
  const std::string file = path("case.toml");
  for (const auto& [line, problem] :
       {std::pair(one(1, {{"sead", 1}}), "case 1: sead: unknown key, did you mean seed?"),
        std::pair(
            one(1, {{"settings", {{"supply_V", 1}}}, {"directives", Json::array({{{"at_s", 9}}})}}),
            "event.at_s: is after the end of the scenario")}) {
    const Outcome outcome = run(line.dump(), {.scenario = file});
    EXPECT_NE(outcome.problem.find(problem), std::string::npos) << outcome.problem;
    EXPECT_EQ(outcome.out, "");
    EXPECT_FALSE(std::filesystem::exists(file));
  }
}

}  // namespace case_stream_test
}  // namespace lk::test
