#include "tools/campaign/report/answer_junit.hpp"

#include <fmt/format.h>

#include "emulator/ground/text.hpp"
#include "tools/campaign/report/answer_text.hpp"

namespace lk::emulator {
namespace {

constexpr std::size_t kCasesTold = 10;

/// What becomes of the test of a kind.
enum class ClassVerdict : std::uint8_t { kPassed, kFailed, kIdle, kAbsent };

ClassVerdict verdict_of(const KindAnswer& kind) {
  if (kind.cases() == 0) return ClassVerdict::kAbsent;
  if (kind.cases() == kind.count(CaseOutcome::kNotFired)) return ClassVerdict::kIdle;
  return kind.failures() > 0 ? ClassVerdict::kFailed : ClassVerdict::kPassed;
}

std::string counts_sentence(const KindAnswer& kind) {
  std::string text = fmt::format("of {} cases", kind.cases());
  for (std::size_t n = kCaseOutcomes; n-- > 0;) {
    const auto outcome = static_cast<CaseOutcome>(n);
    if (kind.count(outcome) > 0)
      text += fmt::format(", {} {}", kind.count(outcome), to_string(outcome));
  }
  return text;
}

std::string failing_cases(const Answer& answer, const std::string& kind) {
  const auto dimension = kind_dimension(answer.head);
  std::string text;
  std::size_t told = 0;
  for (const CaseResult& result : answer.residual) {
    if (kind_of(result, dimension) != kind) continue;
    if (told++ == kCasesTold) return text + "and more: --json\n";
    text += case_sentence(result, answer.head) + "\n  " + answer.command_of(result.number) + '\n';
  }
  return text;
}

std::string class_case(const Answer& answer, const KindAnswer& kind) {
  std::string text = fmt::format(R"(    <testcase name="fault {}" classname="{}")",
                                 xml_escaped(kind.kind), xml_escaped(answer.head.plan_name));
  switch (verdict_of(kind)) {
    case ClassVerdict::kPassed:
      return text + "/>\n";
    case ClassVerdict::kAbsent:
      return text + ">\n      <skipped message=\"no case has it\"/>\n    </testcase>\n";
    case ClassVerdict::kIdle:
      return text + fmt::format(
                        ">\n      <error message=\"in none of {} cases did it take "
                        "effect\"/>\n    </testcase>\n",
                        kind.cases());
    case ClassVerdict::kFailed:
      break;
  }
  return text + fmt::format(">\n      <failure message=\"{}\">{}</failure>\n    </testcase>\n",
                            xml_escaped(counts_sentence(kind)),
                            xml_escaped(failing_cases(answer, kind.kind)));
}

}  // namespace

std::string answer_junit(const Answer& answer) {
  std::array<std::size_t, 4> verdicts{};
  std::string tests;
  for (const KindAnswer& kind : answer.kinds) {
    ++verdicts.at(static_cast<std::size_t>(verdict_of(kind)));
    tests += class_case(answer, kind);
  }
  const auto count = [&](ClassVerdict one) { return verdicts.at(static_cast<std::size_t>(one)); };
  const CampaignHead& head = answer.head;
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"lk-emu\">\n"
      "  <testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\">\n"
      "    <properties>\n"
      "      <property name=\"version\" value=\"{}\"/>\n"
      "      <property name=\"sampling\" value=\"{}\"/>\n"
      "      <property name=\"seed\" value=\"{}\"/>\n"
      "      <property name=\"cases\" value=\"{}\"/>\n"
      "    </properties>\n{}  </testsuite>\n</testsuites>\n",
      xml_escaped(head.plan_name), answer.kinds.size(), count(ClassVerdict::kFailed),
      count(ClassVerdict::kIdle), count(ClassVerdict::kAbsent), xml_escaped(head.version),
      kSamplingWords.at(static_cast<std::size_t>(head.sampling)), head.seed, answer.all.cases(),
      tests);
}

}  // namespace lk::emulator
