#pragma once

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "emulator/config/config_reader.hpp"

namespace lk::emulator {

/// Ordered: answers list things in the order in which people read them.
using Json = nlohmann::ordered_json;

/// Text that is no JSON, or more of it than anybody needs; `where` is a key or a place.
struct JsonError : std::runtime_error {
  JsonError(std::string at, const std::string& why)
      : std::runtime_error(why), where(std::move(at)) {}
  std::string where;
};

/// Objects and lists in each other, at most.
inline constexpr int kDeepestJson = 16;

/// Throws JsonError.
Json parse_json(std::string_view text);

/// The same as a TOML table, for those who read such. `json` must be an object; null has no
/// counterpart and is refused. Throws JsonError.
toml::table to_table(const Json& json);

}  // namespace lk::emulator
