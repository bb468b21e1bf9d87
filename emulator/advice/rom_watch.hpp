#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// ROM that is written again and again: each write wears it.
class RomWatch {
 public:
  /// A person who sets a robot up writes a few times; ten of one kind are a program's (assumed).
  static constexpr std::size_t kWrites = 10;
  /// A memory that lasts this long at the rate of those ten is no news (assumed).
  static constexpr SimTime kLongLife = std::chrono::hours(365 * 24);

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);

 private:
  /// Of one parameter: the times of the last ten, in a ring.
  struct Writes {
    std::array<SimTime, kWrites> at{};
    std::size_t count = 0;
  };
  Writes gains_;
  Writes offset_;
};

}  // namespace lk::emulator
