#include "tools/ctl/ctl_words.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <string_view>

#include "emulator/ground/start_error.hpp"

namespace lk::emulator {
namespace {

/// Returns true for keys whose values are always text: ids=1, name=7.
bool is_text_key(std::string_view key) {
  constexpr std::string_view kText[] = {"ids", "bus", "name", "mark", "clear", "power"};
  return std::ranges::find(kText, key) != std::end(kText);
}

Json value_of(const std::string& key, const std::string& text) {
  if (is_text_key(key)) return text;
  if (text == "true") return true;
  if (text == "false") return false;
  if (text.starts_with('{') || text.starts_with('[')) {
    try {
      return parse_json(text);
    } catch (const JsonError& problem) {
      throw StartError("ctl: " + key + ": " + problem.what());
    }
  }
  const char* const last = text.data() + text.size();
  std::int64_t whole = 0;
  const auto [whole_end, whole_error] = std::from_chars(text.data(), last, whole);
  if (whole_error == std::errc() && whole_end == last) return whole;
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), last, number);
  if (error == std::errc() && end == last && std::isfinite(number)) return number;
  return text;
}

}  // namespace

void put_word(Json& object, const std::string& word) {
  const std::size_t equals = word.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw StartError("ctl: \"" + word + "\" is not KEY=VALUE, like supply_V=18");
  }
  Json* place = &object;
  std::string key = word.substr(0, equals);
  for (std::size_t dot = key.find('.'); dot != std::string::npos; dot = key.find('.')) {
    place = &(*place)[key.substr(0, dot)];
    if (!place->is_null() && !place->is_object()) {
      throw StartError("ctl: \"" + word + "\": " + key.substr(0, dot) + " has a value already");
    }
    key.erase(0, dot + 1);
  }
  if (place->contains(key)) throw StartError("ctl: " + word.substr(0, equals) + " is given twice");
  (*place)[key] = value_of(key, word.substr(equals + 1));
}

double parse_span_s(const std::string& text) {
  struct Unit {
    std::string_view word;
    double s;
  };
  constexpr Unit kUnits[] = {{"", 1},      {"s", 1},    {"ms", 1e-3},
                             {"us", 1e-6}, {"min", 60}, {"h", 3600}};
  double number = 0;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  if (error == std::errc() && number >= 0) {
    const std::string_view word(end, static_cast<std::size_t>(last - end));
    for (const Unit& unit : kUnits) {
      if (word == unit.word) return number * unit.s;
    }
  }
  throw StartError("ctl: \"" + text + "\" is not a time, like 10ms, 1.5s or 2min");
}

}  // namespace lk::emulator
