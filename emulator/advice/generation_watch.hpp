#pragma once

#include <cstdint>
#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Frames that make sense to a drive of another generation, and not to this one.
class GenerationWatch {
 public:
  /// A host may ask once or twice to find out which generation it has to do with (assumed).
  static constexpr int kUnknown = 3;
  /// Unused bytes may hold anything; the same plausible limit so often is meant (assumed).
  static constexpr int kSameLimit = 10;

  /// A command that this drive does not have.
  std::optional<Finding> hear_unknown(const protocol::Frame& frame, const KnownDrive& drive);
  std::optional<Finding> hear(const Heard& heard, const KnownDrive& drive);

 private:
  std::optional<Finding> hear_limit(std::int16_t limit_lsb, const KnownDrive& drive);

  int unknown_ = 0;
  std::int16_t limit_lsb_ = 0;
  int same_limit_ = 0;
};

}  // namespace lk::emulator
