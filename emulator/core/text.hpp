#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lk::emulator {

/// Removes the first character of untrusted text and returns it if terminals, logs, XML and
/// pictures show it unchanged. Else removes one byte and returns "?": control characters, marks of
/// writing direction, non-characters, invalid UTF-8.
std::string_view next_character(std::string_view& rest);

/// Returns the text as a terminal or a log can show it on one line.
std::string sanitized_line(std::string_view text);

/// Converts names to lower case for comparison, ASCII only in every locale.
inline std::string small_letters(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

/// Returns the text without spaces and tabs before and after it.
constexpr std::string_view trimmed(std::string_view text) {
  while (text.starts_with(' ') || text.starts_with('\t')) text.remove_prefix(1);
  while (text.ends_with(' ') || text.ends_with('\t')) text.remove_suffix(1);
  return text;
}

/// Parses all of `digits` as a number in this base, up to `most`; nullopt if invalid.
inline std::optional<std::uint64_t> number_of(std::string_view digits, int base,
                                              std::uint64_t most) {
  std::uint64_t value = 0;
  const char* const end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, value, base);
  const bool whole = error == std::errc() && stop == end && value <= most;
  return whole ? std::optional(value) : std::nullopt;
}

/// Formats with at most `figures` significant digits: "0.5", "360".
std::string plain_number(double value, int figures = 10);

/// Joins words: "legacy, v235, v236".
std::string comma_list(const std::vector<std::string>& words);

/// Returns the name in `known` that is closest to `word`; empty if none is close.
std::string closest_match(const std::string& word, const std::vector<std::string>& known);

/// Escapes text for XML, between tags and in an attribute. A question mark replaces characters that
/// XML 1.0 cannot carry, or that next_character rejects.
std::string xml_escaped(std::string_view text);

}  // namespace lk::emulator
