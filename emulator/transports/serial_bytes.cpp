#include "emulator/transports/serial_bytes.hpp"

#include "protocol/serial_framing.hpp"

namespace lk::emulator {

void SerialBytes::take(std::span<const std::uint8_t> bytes, Time /*now*/, FromClient& heard) {
  protocol::append_frames(bytes, heard.frames);
}

void SerialBytes::show(const protocol::Frame& frame, Time /*now*/, std::string& out) {
  const protocol::WireBytes wire = protocol::wire_bytes(frame);
  out.append(wire.view().begin(), wire.view().end());
}

}  // namespace lk::emulator
