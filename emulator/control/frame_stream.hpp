#pragma once

#include <cstddef>
#include <memory>

#include "emulator/control/http_session.hpp"

namespace lk::emulator {

/// At once, of all clients: each takes every frame apart on the loop of the drives.
inline constexpr int kMostFrameStreams = 8;
/// That wait for one client.
inline constexpr std::size_t kMostGathered = 1024;

/// Answers the upgrade and tells every frame of `line`, in words, until the client has gone; keeps
/// itself alive. A client that reads too slowly misses frames.
void stream_frames(HttpStream stream, HttpUpgrade upgrade, Line& line,
                   std::shared_ptr<HttpShared> shared, std::shared_ptr<Entrance> entrance);

}  // namespace lk::emulator
