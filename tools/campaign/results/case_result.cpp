#include "tools/campaign/results/case_result.hpp"

#include <charconv>

namespace lk::emulator {

std::string value_text(const CaseValue& value) {
  if (const auto* word = std::get_if<std::string>(&value)) return *word;
  char text[32];
  const double number = std::get<double>(value) + 0.0;  // no "-0"
  return {text, std::to_chars(text, text + sizeof text, number).ptr};
}

std::uint64_t missing_cases(const CampaignHead& head, std::uint64_t count) {
  const bool known = head.numbers <= kMostCounted || head.cases < head.numbers ||
                     head.plan_text.find("exclude") == std::string::npos;
  return known && count < head.cases ? head.cases - count : 0;
}

}  // namespace lk::emulator
