#include "emulator/control/http_target.hpp"

#include <charconv>

namespace lk::emulator {
namespace {

std::string decode(std::string_view text) {
  std::string plain;
  for (std::size_t n = 0; n < text.size(); ++n) {
    if (text[n] == '+') {
      plain += ' ';
    } else if (text[n] != '%') {
      plain += text[n];
    } else {
      unsigned code = 0;
      const std::string_view digits = text.substr(n + 1, 2);
      const char* const last = digits.data() + digits.size();
      const auto [end, error] = std::from_chars(digits.data(), last, code, 16);
      if (digits.size() != 2 || error != std::errc() || end != last) {
        throw ApiError(400, "query", "a % is followed by two hexadecimal digits");
      }
      plain += static_cast<char>(code);
      n += 2;
    }
  }
  return plain;
}

}  // namespace

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
    const std::string key = decode(pair.substr(0, equals));
    if (!request.query.emplace(key, decode(pair.substr(equals + 1))).second) {
      throw ApiError(400, key, "is given twice");
    }
    rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  }
}

}  // namespace lk::emulator
