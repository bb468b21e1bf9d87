#pragma once

#include <linux/can.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tests/vcan/emulator_process.hpp"

namespace lk::vcan {

using Payload = std::array<std::uint8_t, 8>;

/// A host program's socket on a CAN interface.
class Host {
 public:
  enum class Loopback : std::uint8_t { kOn, kOff };

  explicit Host(const std::string& interface, Loopback loopback = Loopback::kOn);
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;
  ~Host();

  void send(canid_t id, const Payload& data) const;
  void send(const can_frame& frame) const;
  void send(const canfd_frame& frame) const;
  /// Of all others' frames it no longer notices any but those of these drives.
  void hear_only(const std::vector<int>& ids) const;
  /// The next frame of another program; nothing when none came within the patience given.
  std::optional<can_frame> receive(int patience_ms = kPatience_ms);
  /// Sends a query to the drive `id` and waits for the next frame, which must be the reply.
  std::optional<Payload> query(int id, const Payload& data);

 private:
  int fd_;
};

}  // namespace lk::vcan
