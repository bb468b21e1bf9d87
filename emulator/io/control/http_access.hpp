#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "emulator/io/control/control_api.hpp"

namespace lk::emulator {

/// Replaces each %XX by its byte. Throws ApiError, which names `part` of the request.
std::string decode_percent(std::string_view text, const char* part);

/// Removes "http://HOST" of an absolute target (RFC 9112, 3.2.2) from `target`. Returns HOST, which
/// replaces the header's; nullopt for "/path".
std::optional<std::string_view> take_authority(std::string_view& target);

/// Parses "/path?key=value&…" into `request`; its path stays encoded. Throws ApiError.
void read_target(std::string_view target, ApiRequest& request);

/// Access rules of one entrance.
struct Access {
  bool own_pages_only = false;   // Host must be an address, and Origin, if present, the same
  std::string token = {};        // required token; empty: none
  bool open_to_others = false;   // no token is required: clients may only read
  bool pages_may_write = false;  // pages, or all clients if open_to_others, may write
};

/// Headers that show where a request comes from.
struct Credentials {
  std::string_view host;
  std::optional<std::string_view> origin;
  std::string_view authorization;
};

/// Reason to refuse a request, for the client.
struct Refusal {
  int status;         // HTTP status
  const char* where;  // the header at fault
  const char* reason;
};
/// Returns nullopt if access is allowed.
std::optional<Refusal> refusal(const Access& access, const Credentials& shown);

/// Subprotocol for pages, which cannot set Authorization on a WebSocket. A page also offers its
/// token: "bearer." and the token's bytes in hexadecimal.
inline constexpr std::string_view kWebSocketProtocol = "lk-emu";
bool offers_protocol(std::string_view offered);
/// Returns the equivalent of the Authorization header; empty if no token is offered.
std::string authorization_of(std::string_view offered);

}  // namespace lk::emulator
