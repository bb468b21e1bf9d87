#include "emulator/control/http_target.hpp"

#include <algorithm>
#include <charconv>

#include "emulator/ground/text.hpp"

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
    unsigned code = 0;
    const std::string_view digits = text.substr(n + 1, 2);
    const char* const last = digits.data() + digits.size();
    const auto [end, error] = std::from_chars(digits.data(), last, code, 16);
    if (digits.size() != 2 || error != std::errc() || end != last) {
      throw ApiError(400, part, "a % is followed by two hexadecimal digits");
    }
    plain += static_cast<char>(code);
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

}  // namespace lk::emulator
