#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/scenario/scenario_run.hpp"

namespace lk::emulator {

/// Watches the traffic of a run: hashes frames from drives, keeps the last command to each drive.
class TrafficWatch {
 public:
  void observe(const std::vector<Traffic>& traffic);
  /// Returns a hash over the bytes, bus and time of each frame from a drive.
  std::uint64_t reply_hash() const { return reply_hash_; }
  /// Returns DATA[0] of the last frame that a host sent to drive `id` on the bus; empty if none.
  std::optional<std::uint8_t> command(std::size_t bus, int id) const;

 private:
  struct Command {
    std::size_t bus;
    std::uint32_t id;
    std::uint8_t byte;
  };
  std::uint64_t reply_hash_ = 0;
  std::vector<Command> commands_;
};

}  // namespace lk::emulator
