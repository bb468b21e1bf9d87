#pragma once

#include <string>

#include "emulator/core/coupling/mechanism.hpp"
#include "emulator/files/json_table.hpp"
#include "emulator/live/world.hpp"

namespace lk::emulator {

/// What `body` looks like, with the drives of `world` that turn its joints, and its present poses.
Json body_json(const World& world, const Mechanism& body);

/// Where it is now: {"time_s", "poses", "contacts"}, as text, since it is told 60 times a second.
std::string body_now_text(SimTime time, const Mechanism& body);

}  // namespace lk::emulator
