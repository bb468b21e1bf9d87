#pragma once

#include <string>

#include "emulator/core/coupling/body_looks.hpp"
#include "emulator/files/json_table.hpp"
#include "emulator/live/world.hpp"

namespace lk::emulator {

/// The body of `world`, where it has one that can be drawn; null: it has none.
const BodyLooks* looks_of(const World& world);

/// What the body of `world`, which can be drawn, looks like, with the drives that turn its joints,
/// and its present poses.
Json body_json(const World& world);

/// Where it is now: {"time_s", "poses", "contacts"}, as text, since it is told 60 times a second.
std::string body_now_text(const World& world);

}  // namespace lk::emulator
