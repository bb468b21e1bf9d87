#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace lk::emulator {

/// Who may come in at one of the places the program listens at.
struct Access {
  bool own_pages_only = false;   // Host names an address, and Origin, if there is one, is the same
  std::string token = {};        // what has to be shown; empty: nothing
  bool open_to_others = false;   // there is no token since none is wanted: all may only look
  bool pages_may_write = false;  // what comes with an Origin, or from all, may do more than look
};

/// What a request says of where it comes from.
struct Credentials {
  std::string_view host;
  std::optional<std::string_view> origin;
  std::string_view authorization;
};

/// Why somebody may not come in, for whom it concerns.
struct Refusal {
  int status;         // of HTTP
  const char* where;  // the header that says so
  const char* reason;
};
/// Nothing: may come in.
std::optional<Refusal> refusal(const Access& access, const Credentials& shown);

/// A page can give a WebSocket no Authorization. It offers this protocol and, for its token, one
/// more: "bearer." and the token's bytes in hexadecimal.
inline constexpr std::string_view kWebSocketProtocol = "lk-emu";
bool offers_protocol(std::string_view offered);
/// What Authorization would say; empty when no token is offered.
std::string authorization_of(std::string_view offered);

}  // namespace lk::emulator
