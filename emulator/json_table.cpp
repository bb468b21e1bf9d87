#include "emulator/json_table.hpp"

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

namespace lk::emulator {
namespace {

using Json = nlohmann::ordered_json;

toml::array json_array(const Json& array);

/// `take` is given the value as TOML has it.
template <class Take>
void convert(const Json& value, Take take) {
  if (value.is_object()) {
    take(json_table(value));
  } else if (value.is_array()) {
    take(json_array(value));
  } else if (value.is_string()) {
    take(value.get<std::string>());
  } else if (value.is_boolean()) {
    take(value.get<bool>());
  } else if (value.is_number_integer()) {
    take(value.get<std::int64_t>());
  } else if (value.is_number()) {
    take(value.get<double>());
  }
}

toml::array json_array(const Json& array) {
  toml::array out;
  for (const Json& value : array) {
    convert(value,
            [&](auto&& as_toml) { out.push_back(std::forward<decltype(as_toml)>(as_toml)); });
  }
  return out;
}

}  // namespace

toml::table json_table(const Json& object) {
  toml::table out;
  for (const auto& [key, value] : object.items()) {
    convert(value, [&, &name = key](auto&& as_toml) {
      out.insert_or_assign(name, std::forward<decltype(as_toml)>(as_toml));
    });
  }
  return out;
}

}  // namespace lk::emulator
