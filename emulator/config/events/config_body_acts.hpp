#pragma once

/// @file Readers for the directives that act on a robot's body: `read_push` reads the key `push`,
/// and so on. Pre: the event has the key. All throw ConfigError.

#include "emulator/config/config_reader.hpp"
#include "emulator/core/coupling/mechanism.hpp"
#include "emulator/core/directive.hpp"

namespace lk::emulator {

BodyAct read_push(TableReader& event, const Mechanism& body);
BodyAct read_payload(TableReader& event, const Mechanism& body);
BodyAct read_freeze(TableReader& event, const Mechanism& body);
BodyAct read_floor(TableReader& event, const Mechanism& body);
BodyAct read_pose(TableReader& event, const Mechanism& body);

}  // namespace lk::emulator
