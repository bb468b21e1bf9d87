#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lk::emulator {

/// Takes the first character off a text that may be anybody's: UTF-8 that terminals, logs, XML and
/// pictures show as it is. "?" in place of a byte of anything else: control characters, those that
/// turn the direction of writing, what is no character, what is no UTF-8.
std::string_view next_character(std::string_view& rest);

/// What a person's terminal or a log can show on one line.
std::string on_one_line(std::string_view text);

/// Names are compared without case, in ASCII whatever the locale is.
inline std::string small_letters(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

/// Without the spaces before and after it.
constexpr std::string_view trimmed(std::string_view text) {
  while (text.starts_with(' ') || text.starts_with('\t')) text.remove_prefix(1);
  while (text.ends_with(' ') || text.ends_with('\t')) text.remove_suffix(1);
  return text;
}

/// All of `digits`, a number in this base up to `most`; nothing: they are none.
inline std::optional<std::uint64_t> number_of(std::string_view digits, int base,
                                              std::uint64_t most) {
  std::uint64_t value = 0;
  const char* const end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, value, base);
  const bool whole = error == std::errc() && stop == end && value <= most;
  return whole ? std::optional(value) : std::nullopt;
}

/// With ten figures, and no more than it needs: "0.5", "360".
std::string plain_number(double value);

/// "legacy, v235, v236"
std::string comma_list(const std::vector<std::string>& words);

/// The name among `known` that `word` was most likely meant to be; empty when none is close.
std::string nearest(const std::string& word, const std::vector<std::string>& known);

/// For XML, between tags and in an attribute. What XML 1.0 cannot carry at all becomes a question
/// mark, and so does what next_character does not take.
std::string xml_escaped(std::string_view text);

}  // namespace lk::emulator
