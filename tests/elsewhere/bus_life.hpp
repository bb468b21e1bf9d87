#pragma once

/// @file A random run of a bus with every motor and generation, and a hash of its results.

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/generation.hpp"
#include "protocol/command_info.hpp"
#include "protocol/serial_framing.hpp"
#include "tests/emulator/whole/random_life.hpp"
#include "tests/fuzz/shipped.hpp"
#include "tests/model/mixed_run.hpp"

namespace lk::test {

using model::test::Hash;

inline void add(Hash& hash, const emulator::TimedFrame& timed) {
  hash.add(static_cast<std::uint64_t>(timed.at.count()));
  hash.add(timed.frame.id);
  hash.add(static_cast<std::uint64_t>(timed.frame.kind));
  hash.add(timed.frame.dlc);
  for (std::size_t n = 0; n < timed.frame.dlc; ++n) hash.add(timed.frame.data[n]);
}

/// Adds every signal of a drive, all bits.
inline void add(Hash& hash, const emulator::DriveView& drive) {
  for (const emulator::Signal& signal : emulator::signals()) {
    hash.add(std::bit_cast<std::uint64_t>(signal.read(drive)));
  }
}

/// Returns `drives` drives with all `motors` and generations in turn, on CAN or on RS-485.
inline emulator::BusConfig every_kind(const std::vector<std::string>& motors, int drives,
                                      bool serial, std::uint64_t seed) {
  using emulator::Generation;
  constexpr std::array kGenerations{Generation::kLegacy, Generation::kLateLegacy, Generation::kV235,
                                    Generation::kV236, Generation::kV236b};
  emulator::BusConfig config;
  config.interface = "life";
  config.seed = seed;
  if (serial) config.serial = emulator::SerialConfig{};
  for (int id = 1; id <= drives; ++id) {
    const auto n = static_cast<std::size_t>(id);
    emulator::ServoConfig servo;
    servo.id = id;
    servo.profile = fuzz::shipped_profile(motors[n % motors.size()]);
    servo.generation = kGenerations[n % kGenerations.size()];
    servo.quirks = serial ? emulator::quirks_of(servo.generation, protocol::Framing::kSerial)
                          : emulator::quirks_of(servo.generation);
    servo.rom = servo.profile.factory;
    servo.rom.broadcast_mode = id <= 2;
    config.servos.push_back(servo);
  }
  return config;
}

/// Random host frames and random events on drives.
class RandomBusRun {
 public:
  explicit RandomBusRun(const emulator::BusConfig& config)
      : serial_(config.serial.has_value()),
        drives_(static_cast<int>(config.servos.size())),
        life_(static_cast<std::uint32_t>(config.seed), drives_, std::chrono::milliseconds(100)),
        bus_(config) {}

  void live_until(emulator::SimTime end) {
    using namespace std::chrono_literals;
    while (at_ < end) {
      at_ += life_.up_to(700us);
      send();
      if (life_.one_in(200)) act();
      if (life_.one_in(2)) look();
    }
    look();
  }

  std::size_t frames() const { return frames_; }
  /// Hash of every frame from drives, and of every signal at each look.
  std::uint64_t hash() const { return hash_.value(); }

 private:
  void send() {
    protocol::Frame frame = life_.frame();
    if (!serial_) {
      bus_.receive({at_, frame});
      return;
    }
    std::vector<protocol::Frame> packets;
    protocol::WireBytes bytes = protocol::wire_bytes(packet());
    if (life_.one_in(20)) bytes.bytes[static_cast<std::size_t>(life_.below(8))] ^= 0x10U;
    protocol::append_frames(bytes.view(), packets);
    for (const protocol::Frame& packet : packets) bus_.receive({at_, packet});
  }

  /// Returns a packet to one drive, with the data length of its command.
  protocol::Frame packet() {
    const auto commands = protocol::serial_commands();
    const auto row = static_cast<std::size_t>(life_.below(static_cast<unsigned>(commands.size())));
    const int id = life_.drive();
    protocol::Frame frame;
    frame.kind = protocol::FrameKind::kSerial;
    frame.id = protocol::kSingleDriveId + static_cast<std::uint32_t>(id);
    for (auto& byte : frame.data) byte = static_cast<std::uint8_t>(life_.below(256));
    frame.data[0] = static_cast<std::uint8_t>(commands[row].opcode);
    const auto length =
        protocol::payload_length(commands[row].query, frame.data, bus_.servo(id).format);
    frame.dlc = static_cast<std::uint8_t>(1 + length.min);
    std::fill(frame.data.begin() + frame.dlc, frame.data.end(), std::uint8_t{0});
    return frame;
  }

  void act() {
    bus_.plan({at_ + life_.up_to(std::chrono::milliseconds(5)), life_.directive(), {}, {}});
    if (life_.one_in(4)) bus_.apply({emulator::kWholeBus, emulator::SetFault{life_.fault()}});
  }

  void look() {
    bus_.advance_to(std::max(at_, bus_.time()));
    std::vector<emulator::TimedFrame> replies;
    bus_.take_replies(replies);
    frames_ += replies.size();
    for (const emulator::TimedFrame& reply : replies) add(hash_, reply);
    for (int id = 1; id <= drives_; ++id) add(hash_, bus_.view(id));
    std::vector<emulator::RomWrite> writes;
    bus_.take_rom_writes(writes);
  }

  bool serial_;
  int drives_;
  RandomInputs life_;
  emulator::Bus bus_;
  emulator::SimTime at_{0};
  std::size_t frames_ = 0;
  Hash hash_;
};

}  // namespace lk::test
