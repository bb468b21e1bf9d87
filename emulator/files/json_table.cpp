#include "emulator/files/json_table.hpp"

#include <cstdint>
#include <limits>
#include <set>
#include <utility>
#include <vector>

namespace lk::emulator {
namespace {

std::string inside(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + "." + key;
}

/// "at byte 12: …" out of the library's "[json.exception.parse_error.101] parse error at line 1,
/// column 13: …".
std::string short_reason(const std::string& text) {
  const std::size_t colon = text.find(": ");
  return colon == std::string::npos ? text : text.substr(colon + 2);
}

template <class Add>
void add_value(const Json& value, const std::string& path, const Add& add);

toml::table table_of(const Json& object, const std::string& path) {
  toml::table table;
  for (const auto& [key, value] : object.items()) {
    add_value(value, inside(path, key), [&, &name = key](auto&& node) {
      table.insert(name, std::forward<decltype(node)>(node));
    });
  }
  return table;
}

toml::array array_of(const Json& list, const std::string& path) {
  toml::array array;
  std::size_t n = 0;
  for (const Json& value : list) {
    add_value(value, path + "[" + std::to_string(n++) + "]",
              [&](auto&& node) { array.push_back(std::forward<decltype(node)>(node)); });
  }
  return array;
}

template <class Add>
void add_value(const Json& value, const std::string& path, const Add& add) {
  constexpr auto kLargest = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  switch (value.type()) {
    case Json::value_t::object:
      return add(table_of(value, path));
    case Json::value_t::array:
      return add(array_of(value, path));
    case Json::value_t::string:
      return add(value.get<std::string>());
    case Json::value_t::boolean:
      return add(value.get<bool>());
    case Json::value_t::number_integer:
      return add(value.get<std::int64_t>());
    case Json::value_t::number_unsigned:
      if (value.get<std::uint64_t>() > kLargest) throw JsonError(path, "the number is too large");
      return add(static_cast<std::int64_t>(value.get<std::uint64_t>()));
    case Json::value_t::number_float:
      return add(value.get<double>());
    case Json::value_t::null:
    case Json::value_t::binary:
    case Json::value_t::discarded:
      break;
  }
  throw JsonError(path, "null says nothing; leave the key out");
}

}  // namespace

Json parse_json(std::string_view text) {
  // The library parses without recursion: depth costs memory only, and that is bounded by the text.
  std::vector<std::set<std::string>> keys;  // of the objects that are open
  const auto look = [&keys](int depth, Json::parse_event_t event, Json& parsed) {
    using Event = Json::parse_event_t;
    if (depth > kDeepestJson) {
      throw JsonError("body", "is nested deeper than " + std::to_string(kDeepestJson) + " levels");
    }
    if (event == Event::object_start) keys.emplace_back();
    if (event == Event::object_end) keys.pop_back();
    if (event == Event::key && !keys.back().insert(parsed.get<std::string>()).second) {
      throw JsonError(parsed.get<std::string>(), "is given twice");
    }
    return true;
  };
  try {
    return Json::parse(text, look);
  } catch (const Json::parse_error& problem) {
    throw JsonError("byte " + std::to_string(problem.byte),
                    "no JSON: " + short_reason(problem.what()));
  } catch (const Json::exception& problem) {
    throw JsonError("body", std::string("no JSON: ") + problem.what());
  }
}

toml::table to_table(const Json& json) {
  if (!json.is_object()) throw JsonError("body", "must be a JSON object");
  return table_of(json, "");
}

}  // namespace lk::emulator
