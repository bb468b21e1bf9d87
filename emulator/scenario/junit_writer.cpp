#include "emulator/scenario/junit_writer.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "emulator/ground/text.hpp"
#include "emulator/scenario/scenario_report.hpp"

namespace lk::emulator {
namespace {

using Status = ExpectationResult::Status;

std::string open_case(const std::string& name, const std::string& suite) {
  return fmt::format(R"(    <testcase name="{}" classname="{}")", xml_escaped(name),
                     xml_escaped(suite));
}

std::string expectation_case(const ExpectationResult& result, const std::string& suite) {
  const std::string name =
      result.says.empty() ? result.expected : result.says + " (" + result.expected + ")";
  std::string text = open_case(name, suite);
  if (result.status == Status::kPassed) return text + "/>\n";
  const char* const kind = result.status == Status::kFailed ? "failure" : "error";
  const std::string message = "expected " + result.expected + ", measured " + result.measured;
  return text + fmt::format(">\n      <{} message=\"{}\"/>\n    </testcase>\n", kind,
                            xml_escaped(message));
}

std::string fault_case(const PlannedFault& fault, const std::string& suite) {
  std::string text = open_case(fault.bus + " fault " + fault.report.fault.name, suite);
  if (fault.took_effect()) return text + "/>\n";
  return text + fmt::format(">\n      <error message=\"{}\"/>\n    </testcase>\n",
                            xml_escaped(fault_sentence(fault)));
}

std::string advice_case(const GivenAdvice& given, const std::string& suite) {
  const Advice& advice = given.advice;
  const std::string name = fmt::format("{} drive {} advice {}", given.bus, advice.id,
                                       advice_row(advice.found.kind).word);
  return open_case(name, suite) +
         fmt::format(">\n      <failure message=\"{}\"/>\n    </testcase>\n",
                     xml_escaped(advice_line(given.bus, advice, Language::kEnglish)));
}

std::string advice_output(const RunReport& report) {
  std::string lines;
  for (const GivenAdvice& given : report.advice) {
    lines += "advice: " + advice_line(given.bus, given.advice, Language::kEnglish) + '\n';
  }
  return "    <system-out>" + xml_escaped(lines) + "</system-out>\n";
}

std::string suite_of(const RunReport& report) {
  const Verdict& verdict = report.verdict;
  const auto failed =
      std::ranges::count(verdict.expectations, Status::kFailed, &ExpectationResult::status);
  const auto open =
      std::ranges::count(verdict.expectations, Status::kOpen, &ExpectationResult::status);
  const auto idle =
      std::ranges::count_if(verdict.faults, [](const auto& fault) { return !fault.took_effect(); });
  // Some reasons already have their own case.
  const bool reasons_apart = !verdict.invalid.empty() && open + idle == 0;
  const auto strict = report.strict ? report.advice.size() : 0;
  std::string text = fmt::format(
      "  <testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"{}\" time=\"{:.3f}\">\n"
      "    <properties>\n"
      "      <property name=\"seed\" value=\"{}\"/>\n"
      "      <property name=\"version\" value=\"" LKEMU_VERSION
      "\"/>\n"
      "      <property name=\"simulated_s\" value=\"{}\"/>\n"
      "      <property name=\"outcome\" value=\"{}\"/>\n"
      "    </properties>\n",
      xml_escaped(report.name),
      verdict.expectations.size() + verdict.faults.size() + strict + (reasons_apart ? 1 : 0),
      static_cast<std::size_t>(failed) + strict, open + idle + (reasons_apart ? 1 : 0),
      report.wall_s, report.seed, in_seconds(report.simulated), outcome_word(report.outcome()));
  for (const auto& result : verdict.expectations) text += expectation_case(result, report.name);
  for (const auto& fault : verdict.faults) text += fault_case(fault, report.name);
  if (reasons_apart) {
    text += open_case("the scenario is valid", report.name) +
            fmt::format(">\n      <error message=\"{}\"/>\n    </testcase>\n",
                        xml_escaped(verdict.invalid.front()));
  }
  if (report.strict) {
    for (const auto& given : report.advice) text += advice_case(given, report.name);
  } else if (!report.advice.empty()) {
    text += advice_output(report);
  }
  if (!verdict.invalid.empty()) {
    std::string reasons;
    for (const std::string& reason : verdict.invalid) reasons += "invalid: " + reason + '\n';
    text += "    <system-err>" + xml_escaped(reasons) + "</system-err>\n";
  }
  return text + "  </testsuite>\n";
}

}  // namespace

std::string junit_xml(const std::vector<RunReport>& reports) {
  std::string text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"lk-emu\">\n";
  for (const RunReport& report : reports) text += suite_of(report);
  return text + "</testsuites>\n";
}

}  // namespace lk::emulator
