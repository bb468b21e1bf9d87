#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "emulator/core/scenario/scenario_run.hpp"

namespace lk::emulator {

/// What hosts have got so far, as one number, and what they have said last. A value.
class TrafficWatch {
 public:
  void hear(const std::vector<Traffic>& traffic);
  /// Of every frame of a drive that hosts have got: its bytes, its bus and its instant.
  std::uint64_t heard() const { return heard_; }
  /// DATA[0] of the latest frame that a host has sent to the drive `id` of the bus.
  std::optional<std::uint8_t> command(std::size_t bus, int id) const;

 private:
  struct Command {
    std::size_t bus;
    std::uint32_t id;
    std::uint8_t byte;
  };
  std::uint64_t heard_ = 0;
  std::vector<Command> commands_;
};

}  // namespace lk::emulator
