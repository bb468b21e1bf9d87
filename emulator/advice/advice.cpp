#include "emulator/advice/advice.hpp"

#include <cstddef>
#include <string_view>

#include "emulator/core/frame_text.hpp"
#include "emulator/core/scenario/scenario_text.hpp"

namespace lk::emulator {
namespace {

std::string filled(std::string_view pattern, const std::array<double, 3>& numbers) {
  std::string text;
  for (std::size_t n = 0; n < pattern.size(); ++n) {
    const bool number = pattern[n] == '{' && n + 2 < pattern.size() && pattern[n + 2] == '}';
    if (!number) {
      text += pattern[n];
      continue;
    }
    text += number_text(numbers[static_cast<std::size_t>(pattern[n + 1] - '1')]);
    n += 2;
  }
  return text;
}

constexpr Words kOnce{" time, first ", " 次，首次 "};
constexpr Words kTimes{" times, first ", " 次，首次 "};
constexpr Words kOpen{" (", "（"};
constexpr Words kAt{" at {1} s): ", "，{1} s）："};

}  // namespace

std::string what_text(const Advice& advice, Language language) {
  return filled(advice.found.what->in(language), advice.found.numbers);
}

std::string advice_line(const std::string& bus, const Advice& advice, Language language) {
  std::string text = bus;
  if (advice.id != 0) text += ":" + std::to_string(advice.id);
  text += ": " + std::string(advice_row(advice.found.kind).word) + ": ";
  text += what_text(advice, language);
  text += std::string(kOpen.in(language)) + std::to_string(advice.count);
  text += (advice.count == 1 ? kOnce : kTimes).in(language);
  text += frame_text(advice.frame);
  const double first_s = std::chrono::duration<double>(advice.first).count();
  return text + filled(kAt.in(language), {first_s}) + todo_text(advice, language);
}

}  // namespace lk::emulator
