#include "emulator/config/toml_depth.hpp"

#include <algorithm>
#include <cstddef>

namespace lk::emulator {
namespace {

/// Length of the quoted text at the start of `text`. Unclosed text, which the parser rejects, ends
/// with its line or the input. Up to two extra quotes may precede the end of a long text.
std::size_t length_of_quoted(std::string_view text) {
  const char quote = text.front();
  const bool long_one = text.size() >= 3 && text[1] == quote && text[2] == quote;
  for (std::size_t n = long_one ? 3 : 1; n < text.size(); ++n) {
    if (text[n] == '\\' && quote == '"') {
      ++n;
    } else if (long_one && text.substr(n, 3) == text.substr(0, 3)) {
      n += 3;
      for (int more = 0; more < 2 && n < text.size() && text[n] == quote; ++more) ++n;
      return n;
    } else if (!long_one && (text[n] == quote || text[n] == '\n')) {
      return text[n] == '\n' ? n : n + 1;
    }
  }
  return text.size();
}

}  // namespace

std::optional<int> line_of_deep_key(std::string_view toml) {
  int line = 1;
  int parts = 1;
  while (!toml.empty()) {
    std::size_t length = 1;
    switch (toml.front()) {
      case '.':
        if (++parts > kMostKeyParts) return line;
        break;
      case '"':
      case '\'':
        length = length_of_quoted(toml);
        break;
      case '#':
        length = std::min(toml.find('\n'), toml.size());
        break;
      case '\n':
      case '=':
      case ',':
      case '[':
      case ']':
      case '{':
      case '}':
        parts = 1;
        break;
      default:
        break;
    }
    line += static_cast<int>(std::ranges::count(toml.substr(0, length), '\n'));
    toml.remove_prefix(length);
  }
  return std::nullopt;
}

}  // namespace lk::emulator
