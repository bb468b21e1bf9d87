#pragma once

#include <variant>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/wire/can_wire.hpp"
#include "emulator/core/wire/serial_wire.hpp"

namespace lk::emulator {

/// Wire of a bus, CAN or RS-485, with the functions of both (can_wire.hpp, serial_wire.hpp).
class Wire {
  // Runs several times per event.
  template <class Self, class Act>
  [[gnu::always_inline]] static auto of(Self& self, Act act) {
    auto* const can = std::get_if<CanWire>(&self.medium_);
    return can != nullptr ? act(*can) : act(std::get<SerialWire>(self.medium_));
  }

 public:
  static constexpr std::size_t kHostQueue = CanWire::kHostQueue;
  static constexpr std::size_t kDriveQueue = CanWire::kDriveQueue;
  static_assert(kHostQueue == SerialWire::kHostQueue && kDriveQueue == SerialWire::kDriveQueue);

  /// Makes a CAN wire.
  explicit Wire(std::int64_t bitrate) : medium_(std::in_place_type<CanWire>, bitrate) {}
  explicit Wire(const BusConfig& config);

  CanWire* can() { return std::get_if<CanWire>(&medium_); }
  SerialWire* serial() { return std::get_if<SerialWire>(&medium_); }
  const SerialWire* serial() const { return std::get_if<SerialWire>(&medium_); }

  std::int64_t bitrate() const {
    return of(*this, [](auto& wire) { return wire.bitrate(); });
  }
  SimTime bits(int count) const {
    return of(*this, [&](auto& wire) { return wire.bits(count); });
  }
  bool host_queue_full() const {
    return of(*this, [](auto& wire) { return wire.host_queue_full(); });
  }
  std::size_t host_queue_size() const {
    return of(*this, [](auto& wire) { return wire.host_queue_size(); });
  }
  std::size_t host_frames_ready(SimTime now) const {
    return of(*this, [&](auto& wire) { return wire.host_frames_ready(now); });
  }
  /// `sender`: number of the host on a CAN bus; becomes the owner in the delivery.
  void send_from_host(SimTime at, const protocol::Frame& frame, std::uint32_t sender = 0) {
    if (auto* const wire = can()) {
      wire->send_from_host(at, frame, sender);
    } else {
      serial()->send_from_host(at, frame);  // where hosts are one sender
    }
  }
  bool drive_queue_full(std::uint32_t owner, std::size_t elsewhere = 0) const {
    return of(*this, [&](auto& wire) { return wire.drive_queue_full(owner, elsewhere); });
  }
  std::size_t drive_frames() const {
    return of(*this, [](auto& wire) { return wire.drive_frames(); });
  }
  std::size_t copies(std::uint32_t owner, const protocol::Frame& frame) const {
    return of(*this, [&](auto& wire) { return wire.copies(owner, frame); });
  }
  /// RS-485 only: the drive does not receive a packet that ends at `end`.
  bool cannot_receive(std::uint32_t owner, SimTime end) const {
    return serial() != nullptr && serial()->cannot_receive(owner, end);
  }
  void send_from_drive(SimTime at, const protocol::Frame& frame, std::uint64_t after_rom_write,
                       std::uint32_t owner, bool blocked) {
    of(*this,
       [&](auto& wire) { wire.send_from_drive(at, frame, after_rom_write, owner, blocked); });
  }
  std::size_t block(std::uint32_t owner, SimTime now) {
    return of(*this, [&](auto& wire) { return wire.block(owner, now); });
  }
  void release(std::uint32_t owner, SimTime now) {
    of(*this, [&](auto& wire) { wire.release(owner, now); });
  }
  std::size_t drop_replies(std::uint32_t owner, SimTime now) {
    return of(*this, [&](auto& wire) { return wire.drop_replies(owner, now); });
  }
  std::optional<SimTime> next_reply_start() const {
    return of(*this, [](auto& wire) { return wire.next_reply_start(); });
  }
  bool several_wait() const {
    return of(*this, [](auto& wire) { return wire.several_wait(); });
  }
  [[gnu::always_inline]] std::optional<SimTime> next_due() const {
    return of(*this, [](auto& wire) { return wire.next_due(); });
  }
  std::optional<WireDelivery> deliver(SimTime until) {
    return of(*this, [&](auto& wire) { return wire.deliver(until); });
  }
  WireCandidate next() const {
    return of(*this, [](auto& wire) { return wire.next(); });
  }
  SimTime busy() const {
    return of(*this, [](auto& wire) { return wire.busy(); });
  }

 private:
  std::variant<CanWire, SerialWire> medium_;
};

}  // namespace lk::emulator
