#include "emulator/monitor/scenario/pcapng.hpp"

#include <cstdint>

#include "emulator/config/bus_name.hpp"
#include "emulator/core/generation.hpp"
#include "protocol/serial_framing.hpp"

namespace lk::emulator {
namespace {

constexpr std::uint32_t kSection = 0x0A0D0D0A;
constexpr std::uint32_t kInterface = 1;
constexpr std::uint32_t kPacket = 6;
constexpr std::uint16_t kSocketCan = 227;
constexpr std::uint16_t kUser0 = 147;  // for private use: RS-485 has no link type
constexpr std::uint16_t kInterfaceName = 2;
constexpr std::uint16_t kInterfaceDescription = 3;
constexpr std::uint16_t kTimeResolution = 9;
constexpr std::uint16_t kPacketFlags = 2;

/// Appends `value` in little-endian order, which the byte-order magic of the file announces.
template <typename Integer>
void put(std::string& out, Integer value) {
  for (std::size_t n = 0; n < sizeof value; ++n) {
    out += static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * n) & 0xFFU);
  }
}

void pad(std::string& out) { out.resize((out.size() + 3) / 4 * 4); }

void put_option(std::string& out, std::uint16_t code, const std::string& value) {
  put(out, code);
  put(out, static_cast<std::uint16_t>(value.size()));
  out += value;
  pad(out);
}

/// Returns a block: type, length, body, and the length again.
std::string block(std::uint32_t type, const std::string& body) {
  const auto length = static_cast<std::uint32_t>(body.size() + 12);
  std::string out;
  put(out, type);
  put(out, length);
  out += body;
  put(out, length);
  return out;
}

/// Returns a frame in SocketCAN format: big-endian identifier with the flags of Linux's can_id,
/// then length, FD flags, data.
std::string socketcan(const protocol::Frame& frame) {
  using protocol::FrameKind;
  const bool fd = frame.kind == FrameKind::kFd;
  std::uint32_t id = frame.id;
  if (frame.extended) id |= 0x80000000U;
  if (frame.kind == FrameKind::kRemote) id |= 0x40000000U;
  if (frame.kind == FrameKind::kError) id |= 0x20000000U;
  std::string out;
  for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(id >> shift & 0xFFU);
  const std::size_t length = fd ? 0 : frame.dlc;  // CAN FD data is not stored
  out += static_cast<char>(length);
  out += static_cast<char>(fd ? 0x04 : 0x00);
  out += std::string(2, '\0');
  if (frame.kind != FrameKind::kRemote) out.append(frame.data.begin(), frame.data.begin() + length);
  return out;
}

/// Returns the bytes of an RS-485 packet as on the wire.
std::string wire_text(const protocol::Frame& frame) {
  const protocol::WireBytes bytes = protocol::wire_bytes(frame);
  return {bytes.view().begin(), bytes.view().end()};
}

}  // namespace

CapturedBus::CapturedBus(const BusConfig& bus) : name(bus.interface), drives("LK-TECH drives:") {
  for (const ServoConfig& servo : bus.servos) {
    drives += drives.ends_with(':') ? " " : ", ";
    drives += std::to_string(servo.id) + " " + std::string(generation_name(servo.generation)) +
              " " + protocol::name_of(servo.profile.series);
  }
}

std::string pcapng_begin(std::span<const CapturedBus> buses) {
  std::string section;
  put(section, std::uint32_t{0x1A2B3C4D});
  put(section, std::uint16_t{1});  // version 1.0
  put(section, std::uint16_t{0});
  put(section, std::int64_t{-1});  // unknown length
  std::string out = block(kSection, section);
  for (const CapturedBus& bus : buses) {
    std::string body;
    put(body, is_serial_name(bus.name) ? kUser0 : kSocketCan);
    put(body, std::uint16_t{0});
    put(body, std::uint32_t{0});  // frames are not truncated
    put_option(body, kInterfaceName, bus.name);
    put_option(body, kInterfaceDescription, bus.drives);
    put_option(body, kTimeResolution, "\x09");
    put_option(body, 0, "");
    out += block(kInterface, body);
  }
  return out;
}

std::string pcapng_frame(std::size_t bus, SimTime at, const protocol::Frame& frame,
                         bool from_host) {
  const std::string data = protocol::is_serial(frame) ? wire_text(frame) : socketcan(frame);
  const auto at_ns = static_cast<std::uint64_t>(at.count());
  std::string body;
  put(body, static_cast<std::uint32_t>(bus));
  put(body, static_cast<std::uint32_t>(at_ns >> 32U));
  put(body, static_cast<std::uint32_t>(at_ns));
  put(body, static_cast<std::uint32_t>(data.size()));
  put(body, static_cast<std::uint32_t>(data.size()));
  body += data;
  pad(body);
  std::string flags;
  put(flags, std::uint32_t{from_host ? 2U : 1U});
  put_option(body, kPacketFlags, flags);
  put_option(body, 0, "");
  return block(kPacket, body);
}

}  // namespace lk::emulator
