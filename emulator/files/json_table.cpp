#include "emulator/files/json_table.hpp"

#include <cstdint>
#include <limits>
#include <set>
#include <utility>
#include <vector>

namespace lk::emulator {
namespace {

/// Keys of one object: each is searched for among those before it.
constexpr std::size_t kMaxJsonKeys = 1000;

std::string inside(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + "." + key;
}

/// Shortens "[json.exception.parse_error.101] parse error at line 1, column 13: …" of the library
/// to the part after the first colon.
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
  throw JsonError(path, "null is not allowed; leave the key out");
}

/// Refuses depth, keys that are given twice and objects with many keys. The library's own callback
/// makes it search a whole list after each element of it.
class Shape : public nlohmann::json_sax<Json> {
 public:
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool start_object(std::size_t) override { return open(); }
  bool end_object() override { return close(); }
  bool start_array(std::size_t) override { return open(); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override {
    std::set<std::string>& keys = keys_.back();
    if (!keys.insert(name).second) throw JsonError(name, "is given twice");
    if (keys.size() > kMaxJsonKeys) {
      throw JsonError(name, "is one of more than " + std::to_string(kMaxJsonKeys) + " keys");
    }
    return true;
  }
  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception& problem) override {
    throw JsonError("byte " + std::to_string(position),
                    "not JSON: " + short_reason(problem.what()));
  }

 private:
  bool open() {
    if (keys_.size() >= std::size_t{kDeepestJson}) {
      throw JsonError("body", "is nested deeper than " + std::to_string(kDeepestJson) + " levels");
    }
    keys_.emplace_back();
    return true;
  }
  bool close() {
    keys_.pop_back();
    return true;
  }

  std::vector<std::set<std::string>> keys_;  // of the objects and lists that are open
};

}  // namespace

Json parse_json(std::string_view text) {
  // The library parses without recursion.
  Shape shape;
  Json::sax_parse(text, &shape);
  return Json::parse(text);
}

toml::table to_table(const Json& json) {
  if (!json.is_object()) throw JsonError("body", "must be a JSON object");
  return table_of(json, "");
}

}  // namespace lk::emulator
