#pragma once

#include <cstddef>
#include <memory>

#include "emulator/io/control/http_session.hpp"

namespace lk::emulator {

/// Limit over all clients: each stream decodes every frame on the loop of the drives.
inline constexpr int kMaxFrameStreams = 8;
/// Frames queued for one client.
inline constexpr std::size_t kMaxGathered = 1024;

/// Answers the upgrade and sends every frame of `line`, decoded, until the client has gone; keeps
/// itself alive. A client that reads too slowly misses frames.
void stream_frames(HttpStream stream, HttpUpgrade upgrade, Line& line,
                   std::shared_ptr<HttpShared> shared, std::shared_ptr<HttpEndpoint> endpoint);

}  // namespace lk::emulator
