#include "emulator/monitor/scenario/scenario_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/scenario/scenario_text.hpp"
#include "emulator/core/text.hpp"

namespace lk::emulator {
namespace {

using Status = ExpectationResult::Status;

/// Returns a <testcase> element. `problem`: its child element, "failure" or "error"; empty: passed.
std::string test_case(const std::string& name, const RunReport& suite, std::string_view problem,
                      const std::string& message) {
  const std::string begin = fmt::format(R"(    <testcase name="{}" classname="{}")",
                                        xml_escaped(name), xml_escaped(suite.name));
  if (problem.empty()) return begin + "/>\n";
  return fmt::format("{}>\n      <{} message=\"{}\"/>\n    </testcase>\n", begin, problem,
                     xml_escaped(message));
}

std::string expectation_case(const ExpectationResult& result, const RunReport& suite) {
  const std::string name = result.description.empty()
                               ? result.expected
                               : result.description + " (" + result.expected + ")";
  const char* const problem = result.status == Status::kPassed   ? ""
                              : result.status == Status::kFailed ? "failure"
                                                                 : "error";
  return test_case(name, suite, problem,
                   "expected " + result.expected + ", measured " + result.measured);
}

/// Returns a test case for each advice if strict; otherwise the advice as output of the suite.
std::string advice_of(const RunReport& report) {
  std::string cases;
  std::string lines;
  for (const GivenAdvice& given : report.advice) {
    const std::string line = advice_line(given.bus, given.advice, Language::kEnglish);
    cases += test_case(fmt::format("{} drive {} advice {}", given.bus, given.advice.id,
                                   advice_row(given.advice.found.kind).word),
                       report, "failure", line);
    lines += "advice: " + line + '\n';
  }
  if (report.strict || lines.empty()) return cases;
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
  // Open expectations and faults without effect have cases of their own, with status "error".
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
  for (const auto& result : verdict.expectations) text += expectation_case(result, report);
  for (const auto& fault : verdict.faults) {
    text += test_case(fault.bus + " fault " + fault.report.fault.name, report,
                      fault.took_effect() ? "" : "error", fault_sentence(fault));
  }
  if (reasons_apart) {
    text += test_case("the scenario is valid", report, "error", verdict.invalid.front());
  }
  text += advice_of(report);
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

namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kPatience = std::chrono::seconds(1);
constexpr auto kStep = std::chrono::milliseconds(200);

}  // namespace

Progress::Progress(std::string name, SimTime duration, bool wanted)
    : name_(std::move(name)),
      duration_(duration),
      wanted_(wanted),
      began_(Clock::now()),
      next_(began_ + kPatience) {}

Progress::~Progress() {
  if (shown_) std::fputs("\r\x1b[K", stderr);
}

double Progress::wall_s() const { return in_seconds(Clock::now() - began_); }

void Progress::show(SimTime now) {
  if (!wanted_ || Clock::now() < next_) return;
  next_ = Clock::now() + kStep;
  shown_ = true;
  const double speed = in_seconds(now) / wall_s();
  const double part = in_seconds(now) / in_seconds(duration_);
  constexpr int kWidth = 20;
  const int full = static_cast<int>(part * kWidth);
  std::fprintf(stderr, "\r\x1b[K%s [%.*s%*s] %.1f of %.1f s, %.1f x real time, %.0f s to go",
               name_.c_str(), full, "====================", kWidth - full, "", in_seconds(now),
               in_seconds(duration_), speed, speed > 0 ? in_seconds(duration_ - now) / speed : 0.0);
  std::fflush(stderr);
}

namespace {

using Status = ExpectationResult::Status;

std::string coloured(const std::string& text, const char* code, bool in_colour) {
  return in_colour ? fmt::format("\x1b[{}m{}\x1b[0m", code, text) : text;
}

std::string status_word(Status status, bool in_colour) {
  if (status == Status::kPassed) return coloured("pass", "32", in_colour);
  return status == Status::kFailed ? coloured("FAIL", "31", in_colour)
                                   : coloured("open", "33", in_colour);
}

const char* colour_of(Outcome outcome) {
  return outcome == Outcome::kPassed ? "32" : outcome == Outcome::kFailed ? "31" : "33";
}

std::string drives_of(const Fault& fault) {
  if (fault.ids.empty()) return "";
  std::string text = fault.ids.size() == 1 ? " of drive" : " of drives";
  for (const int id : fault.ids) text += fmt::format(" {}", id);
  return text;
}

std::string count(std::size_t number, const char* noun) {
  return fmt::format("{} {}{}", number, noun, number == 1 ? "" : "s");
}

}  // namespace

const char* outcome_word(Outcome outcome) {
  return outcome == Outcome::kPassed   ? "passed"
         : outcome == Outcome::kFailed ? "failed"
                                       : "invalid";
}

int exit_status(Outcome outcome) {
  return outcome == Outcome::kPassed ? 0 : outcome == Outcome::kFailed ? 1 : 3;
}

std::string fault_sentence(const PlannedFault& fault) {
  const FaultEvidence& evidence = fault.report.evidence;
  const std::string who =
      fmt::format("{} {}{}", fault.bus, fault.report.fault.name, drives_of(fault.report.fault));
  if (!evidence.began_at) return who + " never began";
  const std::string began = fmt::format("{} began at {}", who, time_text(*evidence.began_at));
  if (!fault.took_effect()) return began + " and changed nothing";
  std::string text = fmt::format("{}, took effect at {}", began,
                                 time_text(evidence.first_effect_at.value_or(*evidence.began_at)));
  if (!evidence.first_on.empty()) text += " on " + evidence.first_on;
  return text + fmt::format(", {} in all", evidence.effects);
}

std::string report_text(const RunReport& report, bool in_colour, Language language) {
  const Verdict& verdict = report.verdict;
  const Outcome outcome = report.outcome();
  std::string speed;
  if (report.wall_s > 0) {
    speed = fmt::format(", {:.0f} x real time", in_seconds(report.simulated) / report.wall_s);
  }
  std::string text = fmt::format("{}: {} ({} simulated in {:.2f} s{}, {}, seed {})\n", report.name,
                                 coloured(outcome_word(outcome), colour_of(outcome), in_colour),
                                 time_text(report.simulated), report.wall_s, speed,
                                 count(report.drives, "drive"), report.seed);
  for (const ExpectationResult& result : verdict.expectations) {
    text += fmt::format("  {}  {}", status_word(result.status, in_colour), result.expected);
    text += fmt::format(" - {}\n", result.measured);
    if (!result.description.empty()) text += fmt::format("        {}\n", result.description);
  }
  for (const PlannedFault& fault : verdict.faults) {
    text += fmt::format("  fault {}\n", fault_sentence(fault));
  }
  const auto note = [&](const char* kind, const char* colour, const std::string& line) {
    text += fmt::format("  {} {}\n", coloured(kind, colour, in_colour), line);
  };
  for (const GivenAdvice& given : report.advice) {
    note("advice:", report.strict ? "31" : "33", advice_line(given.bus, given.advice, language));
  }
  if (verdict.unasked.motion.deg > Unasked::kFar_deg) {
    note("unasked motion:", "33", unasked_text(verdict.unasked));
  }
  for (const std::string& warning : report.warnings) note("warning:", "33", warning);
  for (const std::string& reason : verdict.invalid) note("invalid:", "33", reason);
  return text;
}

}  // namespace lk::emulator
