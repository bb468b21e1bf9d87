#pragma once

#include <optional>

#include "emulator/transports/client_protocol.hpp"
#include "emulator/transports/rfc2217.hpp"

namespace lk::emulator {

/// A byte that was sent at another bit rate: something arrives, and it is not what was sent.
constexpr std::uint8_t misread(std::uint8_t byte) {
  return static_cast<std::uint8_t>(byte * 167U + 59U) | 0x80U;
}

/// RS-485: bytes of packets, as they are. A client whose first bytes are a command of telnet speaks
/// RFC 2217; packets begin with no such byte.
class SerialBytes final : public ClientProtocol {
 public:
  /// `bitrate` of the bus, which a client that sets one has to hit; 0: whatever it sets.
  explicit SerialBytes(std::int64_t bitrate) : bitrate_(bitrate) {}

  void take(std::span<const std::uint8_t> bytes, Time now, FromClient& heard) override;
  void show(const protocol::Frame& frame, Time now, std::string& out) override;

 private:
  enum class First : std::uint8_t { kNothing, kIac, kOther };  // of the client's bytes

  void take_byte(std::uint8_t byte, Rfc2217::Answer& answer);
  bool wrong_rate() const { return telnet_ && bitrate_ > 0 && telnet_->rate() != bitrate_; }

  std::int64_t bitrate_;
  First first_ = First::kNothing;
  std::optional<Rfc2217> telnet_;
  std::uint32_t misread_at_ = 0;  // the rate at which data came that nobody understands
  std::vector<std::uint8_t> data_;
};

}  // namespace lk::emulator
