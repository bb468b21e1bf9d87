#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lk::emulator {

/// Who may come in at one of the places the program listens at.
struct Access {
  std::vector<std::string> hosts;  // what Host may be; empty: anything
  std::string token;               // what has to be shown; empty: nothing
};

/// What a request says of where it comes from.
struct Credentials {
  std::string_view host;
  std::optional<std::string_view> origin;
  std::string_view authorization;
};

/// 0: may come in; else the HTTP status to refuse it with.
int refusal(const Access& access, const Credentials& shown);
/// Why, for the one who is refused.
std::string refusal_reason(int status);

/// What browsers and clients call this machine, seen from itself, at that port.
std::vector<std::string> loopback_hosts(unsigned port);

}  // namespace lk::emulator
