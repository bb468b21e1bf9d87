#pragma once

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "emulator/config/config_reader.hpp"

namespace lk::emulator {

/// JSON that keeps the order of keys, so that answers have the order of their documentation.
using Json = nlohmann::ordered_json;

/// Thrown for text that is not valid JSON or exceeds a limit; `where` is a key or a position.
struct JsonError : std::runtime_error {
  JsonError(std::string at, const std::string& why)
      : std::runtime_error(why), where(std::move(at)) {}
  std::string where;
};

/// Limit for the nesting depth of objects and lists.
inline constexpr int kDeepestJson = 16;

/// Throws JsonError.
Json parse_json(std::string_view text);

/// Parses a JSON object into a table for a TableReader; the values have no line numbers. Rejects
/// null, which TOML does not have. Throws JsonError.
toml::table parse_json_table(std::string_view text);

}  // namespace lk::emulator
