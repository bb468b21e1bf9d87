#pragma once

#include <cstdint>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Finding for a command or parameter that this drive does not have. Given at the first time: a
/// host may ask once, then give up or wait for ever.
Finding unknown_command(const protocol::Frame& frame, const KnownDrive& drive);

/// Returns true for a 32-bit target to a drive that reads only 16 bits.
bool has_wide_target(const Heard& heard, const KnownDrive& drive);

/// Detects fields that have a meaning only for drives of another generation.
class GenerationWatch {
 public:
  /// Unused bytes may hold anything; one plausible limit, repeated so often, is meant (assumed).
  static constexpr int kSameLimit = 10;

  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);

 private:
  std::optional<Finding> hear_limit(std::int16_t limit_lsb, const KnownDrive& drive);

  std::int16_t limit_lsb_ = 0;
  int same_limit_ = 0;
};

}  // namespace lk::emulator
