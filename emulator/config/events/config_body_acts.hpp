#pragma once

/// @file What directives do to a robot's body.

#include <optional>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/coupling/mechanism.hpp"
#include "emulator/core/directive.hpp"

namespace lk::emulator {

/// The words of such directives.
inline constexpr const char* kBodyActs[] = {"push", "payload", "freeze", "floor", "pose"};

/// Reads one of them, where it is there. Throws ConfigError; `body` may be null.
std::optional<BodyAct> read_body_act(TableReader& reader, const Mechanism* body);

}  // namespace lk::emulator
