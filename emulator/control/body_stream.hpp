#pragma once

#include <memory>

#include "emulator/control/http_session.hpp"

namespace lk::emulator {

/// At once, of all clients.
inline constexpr int kMostBodyStreams = 8;

/// Answers the upgrade and tells where the body is, 60 times a second of the wall where time goes
/// on, until the client has gone; keeps itself alive. A client that reads too slowly gets fewer.
void stream_body(HttpStream stream, HttpUpgrade upgrade, std::shared_ptr<HttpShared> shared,
                 std::shared_ptr<Entrance> entrance);

}  // namespace lk::emulator
