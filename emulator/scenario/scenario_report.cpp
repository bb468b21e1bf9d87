#include "emulator/scenario/scenario_report.hpp"

#include <fmt/format.h>

#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/scenario/scenario_text.hpp"

namespace lk::emulator {
namespace {

using Status = ExpectationResult::Status;

std::string coloured(const std::string& text, const char* code, bool in_colour) {
  return in_colour ? fmt::format("\x1b[{}m{}\x1b[0m", code, text) : text;
}

std::string status_word(Status status, bool in_colour) {
  switch (status) {
    case Status::kPassed:
      return coloured("pass", "32", in_colour);
    case Status::kFailed:
      return coloured("FAIL", "31", in_colour);
    case Status::kOpen:
      return coloured("open", "33", in_colour);
  }
  return "";
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
  switch (outcome) {
    case Outcome::kPassed:
      return "passed";
    case Outcome::kFailed:
      return "failed";
    case Outcome::kInvalid:
      return "invalid";
  }
  return "";
}

int exit_status(Outcome outcome) {
  return outcome == Outcome::kPassed ? 0 : outcome == Outcome::kFailed ? 1 : 3;
}

double in_seconds(SimTime time) { return std::chrono::duration<double>(time).count(); }

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
    speed =
        fmt::format(", {} x real time", number_text(in_seconds(report.simulated) / report.wall_s));
    if (const auto point = speed.find('.'); point != std::string::npos) {
      speed = fmt::format(", {:.0f} x real time", in_seconds(report.simulated) / report.wall_s);
    }
  }
  std::string text = fmt::format("{}: {} ({} simulated in {:.2f} s{}, {}, seed {})\n", report.name,
                                 coloured(outcome_word(outcome), colour_of(outcome), in_colour),
                                 time_text(report.simulated), report.wall_s, speed,
                                 count(report.drives, "drive"), report.seed);
  for (const ExpectationResult& result : verdict.expectations) {
    text += fmt::format("  {}  {}", status_word(result.status, in_colour), result.expected);
    text += fmt::format(" - {}\n", result.measured);
    if (!result.says.empty()) text += fmt::format("        {}\n", result.says);
  }
  for (const PlannedFault& fault : verdict.faults) {
    text += fmt::format("  fault {}\n", fault_sentence(fault));
  }
  for (const GivenAdvice& given : report.advice) {
    text += fmt::format("  {} {}\n", coloured("advice:", report.strict ? "31" : "33", in_colour),
                        advice_line(given.bus, given.advice, language));
  }
  for (const std::string& warning : report.warnings) {
    text += fmt::format("  {} {}\n", coloured("warning:", "33", in_colour), warning);
  }
  for (const std::string& reason : verdict.invalid) {
    text += fmt::format("  {} {}\n", coloured("invalid:", "33", in_colour), reason);
  }
  return text;
}

}  // namespace lk::emulator
