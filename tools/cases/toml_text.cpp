#include "tools/cases/toml_text.hpp"

#include <algorithm>
#include <charconv>
#include <sstream>
#include <string_view>

namespace lk::emulator {
namespace {

std::string leaf_text(const toml::node& node) {
  std::ostringstream text;
  text << toml::toml_formatter{node, toml::format_flags::none};  // strings in "", on one line
  return text.str();
}

std::string key_text(std::string_view key) {
  const bool bare = !key.empty() && std::ranges::all_of(key, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  });
  return bare ? std::string(key) : leaf_text(toml::value<std::string>(key));
}

std::string float_text(double value) {
  char buffer[32];
  std::string text(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
  // Without a point it would be read as a whole number.
  const bool whole = text.find_first_not_of("-0123456789") == std::string::npos;
  return whole ? text + ".0" : text;
}

std::string node_text(const toml::node& node);

std::string pair_text(const toml::key& key, const toml::node& value) {
  return key_text(key.str()) + " = " + node_text(value);
}

std::string node_text(const toml::node& node) {
  if (const auto number = node.as_floating_point()) return float_text(number->get());
  std::string text;
  if (const auto* array = node.as_array()) {
    for (const toml::node& one : *array) text += (text.empty() ? "" : ", ") + node_text(one);
    return "[ " + text + " ]";
  }
  if (const auto* table = node.as_table()) {
    for (const auto& [key, one] : *table) text += (text.empty() ? " " : ", ") + pair_text(key, one);
    return '{' + text + " }";
  }
  return leaf_text(node);
}

const toml::array* tables(const toml::node& node) {
  const toml::array* array = node.as_array();
  return array != nullptr && !array->empty() && array->is_homogeneous<toml::table>() ? array
                                                                                     : nullptr;
}

}  // namespace

std::string toml_lines(const toml::table& table) {
  std::string text;
  for (const auto& [key, node] : table) text += (text.empty() ? "" : "\n") + pair_text(key, node);
  return text;
}

std::string toml_text(const toml::table& document) {
  std::string text;
  for (const auto& [key, node] : document) {
    if (tables(node) == nullptr) text += pair_text(key, node) + '\n';
  }
  for (const auto& [key, node] : document) {
    const toml::array* array = tables(node);
    for (std::size_t n = 0; array != nullptr && n < array->size(); ++n) {
      text +=
          "\n[[" + key_text(key.str()) + "]]\n" + toml_lines(*array->get_as<toml::table>(n)) + '\n';
    }
  }
  return text;
}

}  // namespace lk::emulator
