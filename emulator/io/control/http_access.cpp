#include "emulator/io/control/http_access.hpp"

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <cstddef>
#include <string>

#include "emulator/core/text.hpp"

namespace lk::emulator {
namespace {

std::string decode_query(std::string_view text) {
  std::string spaced(text);
  std::replace(spaced.begin(), spaced.end(), '+', ' ');
  return decode_percent(spaced, "query");
}

}  // namespace

std::string decode_percent(std::string_view text, const char* part) {
  std::string plain;
  for (std::size_t n = 0; n < text.size(); ++n) {
    if (text[n] != '%') {
      plain += text[n];
      continue;
    }
    const std::string_view digits = text.substr(n + 1, 2);
    const auto code = number_of(digits, 16, 255);
    if (digits.size() != 2 || !code) {
      throw ApiError(400, part, "a % is followed by two hexadecimal digits");
    }
    plain += static_cast<char>(*code);
    n += 2;
  }
  return plain;
}

std::optional<std::string_view> take_authority(std::string_view& target) {
  constexpr std::string_view kScheme = "http://";
  if (small_letters(std::string(target.substr(0, kScheme.size()))) != kScheme) return std::nullopt;
  target.remove_prefix(kScheme.size());
  const std::string_view host = target.substr(0, target.find_first_of("/?"));
  target.remove_prefix(host.size());
  if (target.empty()) target = "/";
  return host;
}

void read_target(std::string_view target, ApiRequest& request) {
  const std::size_t question = target.find('?');
  request.path = target.substr(0, question);
  std::string_view rest =
      question == std::string_view::npos ? std::string_view() : target.substr(question + 1);
  while (!rest.empty()) {
    const std::size_t end = rest.find('&');
    const std::string_view pair = rest.substr(0, end);
    const std::size_t equals = pair.find('=');
    if (equals == std::string_view::npos) throw ApiError(400, "query", "is a list of KEY=VALUE");
    const std::string key = decode_query(pair.substr(0, equals));
    if (!request.query.emplace(key, decode_query(pair.substr(equals + 1))).second) {
      throw ApiError(400, key, "is given twice");
    }
    rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  }
}

namespace {

/// Compares in a time that does not depend on the content, so that it reveals nothing.
bool same_secret(std::string_view shown, std::string_view secret) {
  unsigned difference = shown.size() == secret.size() ? 0 : 1;
  for (std::size_t n = 0; n < secret.size(); ++n) {
    const char c = n < shown.size() ? shown[n] : '\0';
    difference |= static_cast<unsigned>(static_cast<unsigned char>(c) ^
                                        static_cast<unsigned char>(secret[n]));
  }
  return difference == 0;
}

/// Calls `take` for each word of a comma-separated list.
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

/// Returns true for `localhost` or an IP address, with or without a port.
bool is_address(std::string_view host) {
  const bool bracketed = host.starts_with('[');
  std::size_t end = host.find(bracketed ? ']' : ':');
  if (end == std::string_view::npos) {
    if (bracketed) return false;
    end = host.size();
  }
  const std::string_view name = bracketed ? host.substr(1, end - 1) : host.substr(0, end);
  const std::string_view rest = host.substr(bracketed ? end + 1 : end);
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  if (!rest.empty() && (rest[0] != ':' || !std::ranges::all_of(rest.substr(1), digit))) {
    return false;
  }
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address(name, error);
  return bracketed ? !error && address.is_v6()
                   : small_letters(std::string(name)) == "localhost" || (!error && address.is_v4());
}

}  // namespace

bool offers_protocol(std::string_view offered) {
  bool found = false;
  each_word(offered, [&](std::string_view word) { found = found || word == kWebSocketProtocol; });
  return found;
}

std::string authorization_of(std::string_view offered) {
  constexpr std::string_view kPrefix = "bearer.";
  std::string authorization;
  each_word(offered, [&](std::string_view word) {
    if (!authorization.empty() || !word.starts_with(kPrefix)) return;
    word.remove_prefix(kPrefix.size());
    std::string token;
    for (; word.size() >= 2; word.remove_prefix(2)) {
      const auto byte = number_of(word.substr(0, 2), 16, 255);
      if (!byte) return;
      token += static_cast<char>(*byte);
    }
    if (word.empty()) authorization = "Bearer " + token;
  });
  return authorization;
}

/// Protects against pages in a browser on this machine. Origin reveals a foreign page; Host reveals
/// a foreign name that resolves to this machine. The port in Host may differ from ours, as a tunnel
/// or a container may use another; Origin must have the same one.
std::optional<Refusal> refusal(const Access& access, const Credentials& shown) {
  if (access.own_pages_only) {
    if (!is_address(shown.host)) return Refusal{403, "Host", "is not this program's"};
    const auto small = [](std::string_view text) { return small_letters(std::string(text)); };
    if (shown.origin && small(*shown.origin) != small("http://" + std::string(shown.host))) {
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

}  // namespace lk::emulator
