#include "emulator/control/http_access.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>

namespace lk::emulator {
namespace {

/// Takes the same time wherever the two differ.
bool same_secret(std::string_view shown, std::string_view secret) {
  unsigned difference = shown.size() == secret.size() ? 0 : 1;
  for (std::size_t n = 0; n < secret.size(); ++n) {
    const char c = n < shown.size() ? shown[n] : '\0';
    difference |= static_cast<unsigned>(static_cast<unsigned char>(c) ^
                                        static_cast<unsigned char>(secret[n]));
  }
  return difference == 0;
}

/// The words of a list with commas.
template <class Take>
void each_word(std::string_view list, const Take& take) {
  while (!list.empty()) {
    const std::size_t comma = std::min(list.find(','), list.size());
    std::string_view word = list.substr(0, comma);
    list.remove_prefix(std::min(comma + 1, list.size()));
    while (word.starts_with(' ')) word.remove_prefix(1);
    while (word.ends_with(' ')) word.remove_suffix(1);
    take(word);
  }
}

}  // namespace

bool offers_protocol(std::string_view offered) {
  bool found = false;
  each_word(offered, [&](std::string_view word) { found = found || word == kWebSocketProtocol; });
  return found;
}

std::string authorization_of(std::string_view offered) {
  constexpr std::string_view kPrefix = "bearer.";
  std::string said;
  each_word(offered, [&](std::string_view word) {
    if (!said.empty() || !word.starts_with(kPrefix)) return;
    word.remove_prefix(kPrefix.size());
    std::string token;
    for (; word.size() >= 2; word.remove_prefix(2)) {
      unsigned byte = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + 2, byte, 16);
      if (error != std::errc() || end != word.data() + 2) return;
      token += static_cast<char>(byte);
    }
    if (word.empty()) said = "Bearer " + token;
  });
  return said;
}

/// A page in a browser on this machine can send requests here. Its Origin gives it away; a name
/// that somebody lets point to 127.0.0.1 is given away by Host.
std::optional<Refusal> refusal(const Access& access, const Credentials& shown) {
  if (!access.hosts.empty()) {
    const auto known = [&](std::string_view host) {
      return std::ranges::find(access.hosts, host) != access.hosts.end();
    };
    if (!known(shown.host)) return Refusal{403, "Host", "is not this program's"};
    constexpr std::string_view kScheme = "http://";
    if (shown.origin &&
        (!shown.origin->starts_with(kScheme) || !known(shown.origin->substr(kScheme.size())))) {
      return Refusal{403, "Origin", "is not this program's"};
    }
  }
  if (!access.token.empty()) {
    constexpr std::string_view kBearer = "Bearer ";
    if (!shown.authorization.starts_with(kBearer) ||
        !same_secret(shown.authorization.substr(kBearer.size()), access.token)) {
      return Refusal{401, "Authorization", "needs the token: Authorization: Bearer …"};
    }
  }
  return std::nullopt;
}

std::vector<std::string> loopback_hosts(unsigned port, const std::string& address) {
  std::string suffix = ":";
  suffix += std::to_string(port);
  std::vector<std::string> hosts;
  for (const std::string& name :
       {std::string("localhost"), std::string("127.0.0.1"), std::string("[::1]"), address}) {
    hosts.push_back(name + suffix);
    if (port == 80) hosts.push_back(name);  // which clients leave out
  }
  return hosts;
}

}  // namespace lk::emulator
