#pragma once

#include "emulator/control/telemetry_stream.hpp"

namespace lk::emulator {

/// At once, of all clients.
inline constexpr int kMostBodyStreams = 8;

/// Answers the upgrade and tells where the body is, 60 times a second of the wall where time goes
/// on, until the client has gone; keeps itself alive. A client that reads too slowly gets fewer.
void stream_body(HttpStream stream,
                 boost::beast::http::request<boost::beast::http::string_body> upgrade,
                 std::shared_ptr<HttpShared> shared, std::shared_ptr<Entrance> entrance);

}  // namespace lk::emulator
