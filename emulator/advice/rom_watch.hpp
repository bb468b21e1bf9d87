#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Detects repeated writes to ROM, which wear it.
class RomWatch {
 public:
  /// A person writes a few times during setup; ten of one kind come from a program (assumed).
  static constexpr std::size_t kWrites = 10;
  /// No advice if the memory lasts longer than this at the rate of the ten writes (assumed).
  static constexpr SimTime kLongLife = std::chrono::hours(365 * 24);

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);

 private:
  /// Times of the last ten writes of one parameter, in a ring.
  struct Writes {
    std::array<SimTime, kWrites> at{};
    std::size_t count = 0;
  };
  Writes gains_;
  Writes offset_;
};

}  // namespace lk::emulator
