#pragma once

#include "emulator/transports/client_protocol.hpp"
#include "protocol/serial_framing.hpp"

namespace lk::emulator {

/// RS-485 as it is: bytes of packets.
class SerialBytes final : public ClientProtocol {
 public:
  void take(std::span<const std::uint8_t> bytes, Time /*now*/, FromClient& heard) override {
    protocol::append_frames(bytes, heard.frames);
  }
  void show(const protocol::Frame& frame, Time /*now*/, std::string& out) override {
    const protocol::WireBytes wire = protocol::wire_bytes(frame);
    out.append(wire.bytes.begin(), wire.bytes.begin() + static_cast<std::ptrdiff_t>(wire.size));
  }
};

}  // namespace lk::emulator
