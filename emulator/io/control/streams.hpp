#pragma once

/// @file Streams over a WebSocket. Each answers the upgrade, sends until its client disconnects,
/// and owns itself. A client that reads too slowly misses samples, frames or poses.

#include <cstddef>
#include <memory>
#include <string>

#include "emulator/core/coupling/drawable_body.hpp"
#include "emulator/core/telemetry.hpp"
#include "emulator/io/control/http_session.hpp"

namespace lk::emulator {

/// Limit of samples queued for one client, bytes; later samples are dropped.
inline constexpr std::size_t kMaxQueued = 1'048'576;
/// Limit for all telemetry streams together, values per second.
inline constexpr double kMaxTelemetryOfAll = 400'000;
/// Limit for all clients together: each stream decodes every frame on the loop of the drives.
inline constexpr int kMaxFrameStreams = 8;
/// Limit of frames queued for one client; later frames are dropped.
inline constexpr std::size_t kMaxGathered = 1024;
/// Limit for all clients together.
inline constexpr int kMaxBodyStreams = 8;

/// The connection of a client that has asked for a stream.
struct StreamPeer {
  HttpStream stream;
  HttpUpgrade upgrade;
  std::shared_ptr<HttpShared> shared;
  std::shared_ptr<HttpEndpoint> endpoint;
};

/// Sends the `wanted` samples.
void stream_telemetry(StreamPeer peer, const TelemetryRequest& wanted);
/// Sends every frame of `line`, decoded.
void stream_frames(StreamPeer peer, Line& line);
/// Sends poses 60 times a second (wall clock) while simulated time advances.
void stream_body(StreamPeer peer);

/// Returns the body of `world`; null if it has no body, or one without shapes to draw.
const DrawableBody* drawable_body(const World& world);
/// Returns shape and present poses of the body, and the drive of each joint. Pre:
/// `drawable_body(world)` is not null.
Json body_json(const World& world);

}  // namespace lk::emulator
