#pragma once

/// @file Directives that act on a robot's body.

#include <optional>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/coupling/mechanism.hpp"
#include "emulator/core/directive.hpp"

namespace lk::emulator {

/// Keys of these directives.
inline constexpr const char* kBodyActs[] = {"push", "payload", "freeze", "floor", "pose"};

/// Reads such a directive if present. Throws ConfigError; `body` may be null.
std::optional<BodyAct> read_body_act(TableReader& reader, const Mechanism* body);

}  // namespace lk::emulator
