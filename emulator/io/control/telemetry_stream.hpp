#pragma once

#include <cstddef>
#include <memory>

#include "emulator/core/telemetry.hpp"
#include "emulator/io/control/http_session.hpp"

namespace lk::emulator {

/// Bytes of samples queued for one client.
inline constexpr std::size_t kMaxQueued = 1'048'576;
/// Limit of values per second, over all streams.
inline constexpr double kMaxTelemetryOfAll = 400'000;

/// Answers the upgrade and sends the `wanted` samples until the client has gone; keeps itself
/// alive. A client that reads too slowly misses samples.
void stream_telemetry(HttpStream stream, HttpUpgrade upgrade, const TelemetryRequest& wanted,
                      std::shared_ptr<HttpShared> shared, std::shared_ptr<HttpEndpoint> endpoint);

}  // namespace lk::emulator
