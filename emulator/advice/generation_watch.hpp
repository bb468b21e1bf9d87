#pragma once

#include <cstdint>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// A command, or a parameter, that this drive does not have. Told at its first time: a host may ask
/// once, and then give up or wait for ever.
Finding unknown_command(const protocol::Frame& frame, const KnownDrive& drive);

/// A target of 32 bits for a drive that reads 16 of them.
bool has_wide_target(const Heard& heard, const KnownDrive& drive);

/// Fields that make sense to a drive of another generation, and not to this one.
class GenerationWatch {
 public:
  /// Unused bytes may hold anything; the same plausible limit so often is meant (assumed).
  static constexpr int kSameLimit = 10;

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);

 private:
  std::optional<Finding> hear_limit(std::int16_t limit_lsb, const KnownDrive& drive);

  std::int16_t limit_lsb_ = 0;
  int same_limit_ = 0;
};

}  // namespace lk::emulator
