#include "emulator/core/text.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

namespace lk::emulator {
namespace {

unsigned byte(char c) { return static_cast<unsigned char>(c); }

/// Returns true for marks of writing direction, and for ends of lines and paragraphs.
bool changes_layout(std::string_view character) {
  constexpr std::string_view kMarks[] = {"\u061C", "\u200E", "\u200F", "\u2028", "\u2029",
                                         "\u202A", "\u202B", "\u202C", "\u202D", "\u202E",
                                         "\u2066", "\u2067", "\u2068", "\u2069"};
  return std::ranges::find(kMarks, character) != std::end(kMarks);
}

/// Returns the length of the first UTF-8 character (RFC 3629, section 4); 0 if it is invalid, not
/// allowed in XML, or invisible.
std::size_t character_length(std::string_view text) {
  const unsigned first = byte(text[0]);
  if (first < 0x80) return first >= 0x20 && first != 0x7F ? 1 : 0;
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < length) return 0;
  for (std::size_t n = 1; n < length; ++n) {
    if ((byte(text[n]) & 0xC0U) != 0x80) return 0;
  }
  const unsigned second = byte(text[1]);
  const bool control = first == 0xC2 && second < 0xA0;
  const bool overlong = (first == 0xE0 && second < 0xA0) || (first == 0xF0 && second < 0x90);
  const bool surrogate = first == 0xED && second >= 0xA0;
  const bool too_large = first == 0xF4 && second >= 0x90;
  const bool no_character = first == 0xEF && second == 0xBF && byte(text[2]) >= 0xBE;
  if (control || overlong || surrogate || too_large || no_character) return 0;
  return changes_layout(text.substr(0, length)) ? 0 : length;
}

std::string_view xml_entity(char c) {
  switch (c) {
    case '&':
      return "&amp;";
    case '<':
      return "&lt;";
    case '>':
      return "&gt;";
    case '"':
      return "&quot;";
    case '\n':
      return "&#10;";
    case '\t':
      return "&#9;";
    case '\r':
      return "&#13;";
    default:
      return "";
  }
}

/// Returns the number of insertions, deletions, replacements and swaps of neighbours (optimal
/// string alignment).
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> before;  // the row before the last
  std::vector<std::size_t> last(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::vector<std::size_t> row{i};
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row.push_back(std::min({last[j] + 1, row[j - 1] + 1, replaced}));
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], before[j - 2] + 1);
      }
    }
    before = std::move(last);
    last = std::move(row);
  }
  return last[b.size()];
}

}  // namespace

std::string_view next_character(std::string_view& rest) {
  const std::size_t length = character_length(rest);
  const std::string_view character = length == 0 ? "?" : rest.substr(0, length);
  rest.remove_prefix(std::max<std::size_t>(length, 1));
  return character;
}

std::string sanitized_line(std::string_view text) {
  std::string out;
  while (!text.empty()) out += next_character(text);
  return out;
}

std::string xml_escaped(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::string_view entity = xml_entity(text.front());
    if (entity.empty()) {
      out += next_character(text);
    } else {
      out += entity;
      text.remove_prefix(1);
    }
  }
  return out;
}

std::string plain_number(double value, int figures) {
  std::array<char, 32> buffer;
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                          std::chars_format::general, figures);
  return error == std::errc() ? std::string(buffer.data(), end) : "?";
}

std::string comma_list(const std::vector<std::string>& words) {
  std::string all;
  for (const auto& word : words) all += (all.empty() ? "" : ", ") + word;
  return all;
}

std::string closest_match(const std::string& word, const std::vector<std::string>& known) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const auto& candidate : known) {
    // Users often omit the unit: max_speed for max_speed_dps.
    const bool cut_short = word.size() >= 3 && candidate.starts_with(word);
    const std::size_t distance = cut_short ? 1 : edit_distance(word, candidate);
    if (distance < best_distance) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

}  // namespace lk::emulator
