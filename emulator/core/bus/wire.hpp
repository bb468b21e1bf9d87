#pragma once

#include <variant>

#include "emulator/core/bus/can_wire.hpp"
#include "emulator/core/bus/serial_wire.hpp"
#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// Wire of a bus, CAN or RS-485 (can_wire.hpp, serial_wire.hpp).
class Wire {
  // Used instead of std::visit, because it is faster and runs several times per event.
  template <class Medium, class Act>
  [[gnu::always_inline]] static auto of(Medium& medium, Act act) {
    auto* const can = std::get_if<CanWire>(&medium);
    return can != nullptr ? act(*can) : act(std::get<SerialWire>(medium));
  }

 public:
  static constexpr std::size_t kDriveQueue = CanWire::kDriveQueue;
  static_assert(kDriveQueue == SerialWire::kDriveQueue);

  explicit Wire(const BusConfig& config);

  CanWire* can() { return std::get_if<CanWire>(&medium_); }
  SerialWire* serial() { return std::get_if<SerialWire>(&medium_); }
  const SerialWire* serial() const { return std::get_if<SerialWire>(&medium_); }

  /// Returns what `act` returns for the medium: wire([](auto& medium) { return medium.busy(); }).
  template <class Act>
  [[gnu::always_inline]] auto operator()(Act act) {
    return of(medium_, act);
  }
  template <class Act>
  [[gnu::always_inline]] auto operator()(Act act) const {
    return of(medium_, act);
  }

  std::int64_t bitrate() const {
    return (*this)([](auto& medium) { return medium.bitrate(); });
  }
  bool host_queue_full() const {
    return (*this)([](auto& medium) { return medium.host_queue_full(); });
  }
  std::size_t host_queue_size() const {
    return (*this)([](auto& medium) { return medium.host_queue_size(); });
  }
  [[gnu::always_inline]] std::optional<SimTime> next_due() const {
    return (*this)([](auto& medium) { return medium.next_due(); });
  }
  std::optional<SimTime> next_reply_start() const {
    return (*this)([](auto& medium) { return medium.next_reply_start(); });
  }
  [[gnu::always_inline]] WireCandidate next() const {
    return (*this)([](auto& medium) { return medium.next(); });
  }

 private:
  std::variant<CanWire, SerialWire> medium_;
};

}  // namespace lk::emulator
