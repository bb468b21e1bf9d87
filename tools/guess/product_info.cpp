#include "tools/guess/product_info.hpp"

#include <fmt/format.h>

#include "protocol/serial_commands.hpp"
#include "protocol/wire.hpp"

namespace lk::emulator {
namespace {

constexpr std::size_t kNameBytes = 20;
constexpr std::uint8_t kOldBytes = 42;  // of the oldest manual
constexpr std::uint8_t kBytes = 58;

std::string name_at(const protocol::Payload& data, std::size_t at) {
  std::string name;
  for (std::size_t n = at; n < at + kNameBytes && data[n] != 0; ++n) {
    name += data[n] >= 0x20 && data[n] <= 0x7E ? static_cast<char>(data[n]) : '?';
  }
  return name;
}

}  // namespace

std::optional<ProductInfo> product_info(const protocol::Frame& reply) {
  const auto& data = reply.data;
  if (reply.kind != protocol::FrameKind::kSerial) return std::nullopt;
  if (data[0] != static_cast<std::uint8_t>(protocol::ReadProduct::kOpcode)) return std::nullopt;
  ProductInfo info{name_at(data, 1), name_at(data, 1 + kNameBytes), ""};
  if (reply.dlc == 1 + kBytes) {
    info.firmware =
        fmt::format("{:.2f}", protocol::get_le<std::uint16_t>(data, kBytes - 1) / 100.0);
  } else if (reply.dlc == 1 + kOldBytes) {
    info.firmware = fmt::format("{:.1f}", data[kOldBytes] / 10.0);
  } else {
    return std::nullopt;
  }
  return info;
}

}  // namespace lk::emulator
