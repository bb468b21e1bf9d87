#pragma once

#include <memory>

#include "emulator/control/http_session.hpp"

namespace lk::emulator {

/// Limit over all clients.
inline constexpr int kMostBodyStreams = 8;

/// Answers the upgrade and sends poses 60 times a second (wall clock) while time advances, until
/// the client has gone; keeps itself alive. A slow client gets fewer.
void stream_body(HttpStream stream, HttpUpgrade upgrade, std::shared_ptr<HttpShared> shared,
                 std::shared_ptr<Entrance> entrance);

}  // namespace lk::emulator
