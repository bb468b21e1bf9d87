#pragma once

#include <string>

namespace lk::emulator {

/// What a person's terminal or a log can show on one line: the control characters in `text`, which
/// may be anybody's, become question marks.
inline std::string on_one_line(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = '?';
  }
  return text;
}

/// Names are compared without case, in ASCII whatever the locale is.
inline std::string small_letters(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

/// Without the spaces before and after it.
inline std::string trimmed(const std::string& text) {
  constexpr const char* kSpaces = " \t";
  const std::size_t first = text.find_first_not_of(kSpaces);
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(kSpaces) - first + 1);
}

}  // namespace lk::emulator
