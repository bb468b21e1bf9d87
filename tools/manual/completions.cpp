#include "tools/manual/completions.hpp"

namespace lk::manual {

std::vector<Argument> all_options(const Word& word, const Word* parent) {
  std::vector<Argument> options = word.options;
  if (parent == nullptr || !word.takes_options_of_parent) return options;
  for (const Argument& option : parent->options) {
    if (option.names.back() != "--help") options.push_back(option);
  }
  return options;
}

std::string spaced(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

std::string shell_quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'') {
      out += "'\\''";
    } else {
      out += c;
    }
  }
  return out + "'";
}

}  // namespace lk::manual
