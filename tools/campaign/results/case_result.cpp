#include "tools/campaign/results/case_result.hpp"

#include <charconv>

namespace lk::emulator {

std::string value_text(const CaseValue& value) {
  if (const auto* word = std::get_if<std::string>(&value)) return *word;
  char text[32];
  const double number = std::get<double>(value) + 0.0;  // no "-0"
  return {text, std::to_chars(text, text + sizeof text, number).ptr};
}

}  // namespace lk::emulator
