#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "emulator/io/control/control_api.hpp"

namespace lk::emulator {

/// Replaces each %XX by its byte. Throws ApiError, which names `part` of the request.
std::string decode_percent(std::string_view text, const char* part);

/// Removes "http://HOST" from an absolute `target` (RFC 9112, 3.2.2). Returns HOST, to be used
/// instead of the header Host; nullopt if the target is only a path.
std::optional<std::string_view> take_authority(std::string_view& target);

/// Parses "/path?key=value&…" into `request`, without decoding the path. Throws ApiError.
void read_target(std::string_view target, ApiRequest& request);

/// Access rules of one endpoint.
struct Access {
  bool own_pages_only = false;   // Host must be an IP address or localhost; Origin, if sent, equal
  std::string token = {};        // required token; empty: none
  bool open_to_others = false;   // no token on any address: clients may only read
  bool pages_may_write = false;  // lets pages write, and all clients if open_to_others
};

/// Headers of a request that `refusal` checks.
struct Credentials {
  std::string_view host;
  std::optional<std::string_view> origin;
  std::string_view authorization;
};

/// Why a request is refused; sent to the client.
struct Refusal {
  int status;         // HTTP status
  const char* where;  // the header at fault
  const char* reason;
};
/// Returns why `access` forbids a request with the headers `shown`; nullopt if it is allowed.
std::optional<Refusal> refusal(const Access& access, const Credentials& shown);

/// Subprotocol for pages, which cannot set Authorization on a WebSocket. A page offers it and a
/// second one with its token: "bearer." and the token's bytes in hexadecimal. `offered` is the
/// header Sec-WebSocket-Protocol.
inline constexpr std::string_view kWebSocketProtocol = "lk-emu";
bool offers_protocol(std::string_view offered);
/// Returns the value that Authorization would have; empty if no token is offered.
std::string authorization_of(std::string_view offered);

}  // namespace lk::emulator
