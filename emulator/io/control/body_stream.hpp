#pragma once

#include <memory>
#include <string>

#include "emulator/core/coupling/drawable_body.hpp"
#include "emulator/files/json_table.hpp"
#include "emulator/io/control/http_session.hpp"
#include "emulator/io/live/world.hpp"

namespace lk::emulator {

/// Returns the body of `world`; null if it has none that can be drawn.
const DrawableBody* drawable_body(const World& world);

/// Returns shape and present poses of the body, with the drives of its joints. Pre:
/// `drawable_body(world)` is not null.
Json body_json(const World& world);

/// Returns {"time_s", "poses", "contacts"} of now, as text: it is sent 60 times a second.
std::string body_state_text(const World& world);

/// Limit over all clients.
inline constexpr int kMaxBodyStreams = 8;

/// Answers the upgrade and sends poses 60 times a second (wall clock) while time advances, until
/// the client has gone; keeps itself alive. A slow client gets fewer.
void stream_body(HttpStream stream, HttpUpgrade upgrade, std::shared_ptr<HttpShared> shared,
                 std::shared_ptr<HttpEndpoint> endpoint);

}  // namespace lk::emulator
