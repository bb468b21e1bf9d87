#pragma once

/// @file An RS-485 bus with noiseless drives, and a host on it, for tests.

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/support/serial.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::test {

/// Returns an RS-485 drive of a generation that always answers after 150 µs.
inline emulator::ServoConfig serial_drive(emulator::Generation generation, int id = 1,
                                          emulator::Series series = emulator::Series::kMf) {
  emulator::ServoConfig config = drive(generation, series, id);
  config.quirks = emulator::quirks_of(generation, protocol::Framing::kSerial);
  config.reply_time = 150us;
  return config;
}

inline emulator::BusConfig serial_bus(std::vector<emulator::ServoConfig> drives,
                                      std::int64_t bitrate = 1'000'000) {
  emulator::BusConfig config = bus_config({}, bitrate);
  config.serial = emulator::SerialConfig{};
  config.servos = std::move(drives);
  return config;
}

/// A host on RS-485.
class SerialHost {
 public:
  explicit SerialHost(const emulator::BusConfig& config) : bus(config) {}
  explicit SerialHost(const emulator::ServoConfig& drive) : bus(serial_bus({drive})) {}

  /// Writes bytes at once at `at`.
  void write(emulator::SimTime at, std::span<const std::uint8_t> written) {
    bus.advance_to(at);
    std::vector<protocol::Frame> frames;
    protocol::append_frames(written, frames);
    for (const protocol::Frame& frame : frames) bus.receive({at, frame});
  }
  /// Advances to `until`; returns the frames received since the last call.
  std::vector<emulator::TimedFrame> read_until(emulator::SimTime until) {
    bus.advance_to(until);
    std::vector<emulator::TimedFrame> replies;
    bus.take_replies(replies);
    return replies;
  }
  /// Returns all bytes received within 20 ms, as text.
  std::string ask(std::string_view query) {
    write(bus.time(), bytes(query));
    std::string text;
    for (const auto& reply : read_until(bus.time() + 20ms)) {
      text += (text.empty() ? "" : " ") + hex(reply.frame);
    }
    return text;
  }

  emulator::Bus bus;
};

}  // namespace lk::test
