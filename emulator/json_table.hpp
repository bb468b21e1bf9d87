#pragma once

#include <toml++/toml.h>

#include <nlohmann/json_fwd.hpp>

namespace lk::emulator {

/// A JSON object as the table that configuration files would have in its place; what TOML has no
/// word for, null, is left out.
toml::table json_table(const nlohmann::ordered_json& object);

}  // namespace lk::emulator
