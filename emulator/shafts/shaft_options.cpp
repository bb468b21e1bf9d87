#include "emulator/shafts/shaft_options.hpp"

#include <charconv>

#include "emulator/config/ip_address.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kExamples = "unix:/tmp/shafts or tcp:29600";

std::optional<std::uint16_t> port_in(std::string_view text) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return port;
}

}  // namespace

std::variant<ShaftOptions, std::string> parse_shafts_place(const std::string& text) {
  ShaftOptions place;
  if (text.starts_with("unix:")) {
    place.path = text.substr(5);
    if (place.path.empty()) return "unix: needs a path, like unix:/tmp/shafts";
    return place;
  }
  if (!text.starts_with("tcp:")) {
    return "\"" + text + "\" is not unix:PATH or tcp:[ADDR:]PORT, like " + kExamples;
  }
  const std::string rest = text.substr(4);
  const std::size_t colon = rest.rfind(':');
  place.address = kLoopback;
  if (colon != std::string::npos) {
    const std::string host = rest.substr(0, colon);
    const auto address = address_in(host);
    if (!address) return "\"" + host + "\" is not an IP address or localhost";
    place.address = *address;
  }
  const auto port = port_in(colon == std::string::npos ? rest : rest.substr(colon + 1));
  if (!port) return "\"" + text + "\" needs a port from 0 to 65535, like tcp:29600";
  place.port = *port;
  return place;
}

std::optional<ShaftsLost> parse_shafts_lost(const std::string& text) {
  if (text == "free") return ShaftsLost::kFree;
  if (text == "stop") return ShaftsLost::kStop;
  return std::nullopt;
}

}  // namespace lk::emulator
