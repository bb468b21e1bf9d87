#pragma once

#include "emulator/transports/client_protocol.hpp"

namespace lk::emulator {

/// RS-485 over TCP: bytes of packets in both directions, unchanged.
class SerialBytes final : public ClientProtocol {
 public:
  void take(std::span<const std::uint8_t> bytes, Time now, FromClient& heard) override;
  void show(const protocol::Frame& frame, Time now, std::string& out) override;
};

}  // namespace lk::emulator
