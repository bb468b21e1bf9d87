#pragma once

#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/websocket/stream_fwd.hpp>
#include <cstddef>
#include <memory>

#include "emulator/control/http_session.hpp"
#include "emulator/core/telemetry.hpp"

namespace lk::emulator {

using HttpStream = boost::beast::basic_stream<boost::asio::generic::stream_protocol>;

/// Bytes of samples that wait for one client.
inline constexpr std::size_t kMostQueued = 1'048'576;
/// Bytes of a WebSocket message of the client.
inline constexpr std::size_t kLongestMessage = 4096;
/// Values a second that all streams together may have.
inline constexpr double kMostTelemetryOfAll = 400'000;

/// A page in a browser can show its token in no other way than among the protocols it offers
/// (http_access.hpp); it wants one of them chosen.
void choose_protocol(boost::beast::websocket::stream<HttpStream, false>& socket,
                     const boost::beast::http::request<boost::beast::http::string_body>& upgrade);

/// Answers the upgrade and tells what is wanted until the client has gone; keeps itself alive. A
/// client that reads too slowly misses samples.
void stream_telemetry(HttpStream stream,
                      boost::beast::http::request<boost::beast::http::string_body> upgrade,
                      const TelemetryRequest& wanted, std::shared_ptr<HttpShared> shared,
                      std::shared_ptr<Entrance> entrance);

}  // namespace lk::emulator
