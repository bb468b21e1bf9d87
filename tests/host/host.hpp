#pragma once

#include <linux/can.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tests/host/emulator_process.hpp"

namespace lk::host {

using Payload = std::array<std::uint8_t, 8>;

/// Returns the `n`th bus of this process, unique on the machine and without CAN in the kernel. It
/// is slcan at a loopback address derived from the process ID.
std::string own_bus(int n = 0);

/// A host program on a bus: a SocketCAN socket, or a client of slcan-tcp:ADDR:PORT.
class Host {
 public:
  enum class Loopback : std::uint8_t { kOn, kOff };

  explicit Host(const std::string& bus, Loopback loopback = Loopback::kOn);
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;
  ~Host();

  void send(canid_t id, const Payload& data) const;
  void send(const can_frame& frame) const;
  void send(const canfd_frame& frame) const;
  /// Receives frames of these drives only from now on. SocketCAN only.
  void hear_only(const std::vector<int>& ids) const;
  /// Receives error frames too. SocketCAN only.
  void hear_errors() const;
  /// Returns the next frame of another program; nothing if none arrives within the patience.
  std::optional<can_frame> receive(int patience_ms = kPatience_ms);
  /// Sends a query to the drive `id` and waits for the next frame, which must be the reply.
  std::optional<Payload> query(int id, const Payload& data);

 private:
  std::optional<can_frame> receive_line(int patience_ms);

  int fd_ = -1;
  bool slcan_ = false;
  std::string heard_;  // received slcan bytes, not yet read
};

}  // namespace lk::host
