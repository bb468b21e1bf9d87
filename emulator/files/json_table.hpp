#pragma once

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "emulator/config/config_reader.hpp"

namespace lk::emulator {

/// Ordered, so that answers keep the order of their documentation.
using Json = nlohmann::ordered_json;

/// Text that is invalid or too large as JSON; `where` is a key or a position.
struct JsonError : std::runtime_error {
  JsonError(std::string at, const std::string& why)
      : std::runtime_error(why), where(std::move(at)) {}
  std::string where;
};

/// Limit for nested objects and lists.
inline constexpr int kDeepestJson = 16;

/// Throws JsonError.
Json parse_json(std::string_view text);

/// Parses an object into the tree that a TableReader reads; its values have no lines. Rejects null,
/// which TOML does not have. Throws JsonError.
toml::table parse_json_table(std::string_view text);

}  // namespace lk::emulator
