#pragma once

#include <string>
#include <vector>

#include "tools/identify/identified.hpp"

namespace lk::emulator {

/// A motor file of what is told within 15 %; the rest is that of `base`, a name or a path as it
/// will stand in the file. Every number has its interval, its quality and where it comes from
/// beside it, and [identified] keeps them for the next time.
std::string motor_text(const IdentifiedDrive& drive, const std::string& base,
                       const std::vector<std::string>& logs);

/// One value of [identified].
struct ExpectedValue {
  const Quantity* quantity = nullptr;
  Estimate estimate;
  int order = 0;  // of cogging
};
/// The [identified] of a motor file. Throws ConfigError.
std::vector<ExpectedValue> expected_values(const std::string& text, const std::string& file);

/// How a drive has changed.
struct Changes {
  int compared = 0;                         // quantities told then and now, within 15 %
  std::vector<std::string> lines;           // one for each that has changed
  std::vector<std::string> not_compared{};  // labels
};
/// A quantity has changed when its intervals, then and now, are apart and its values differ by more
/// than a tenth (assumed). `file` is what `expected` is of.
Changes changes(const IdentifiedDrive& drive, const std::vector<ExpectedValue>& expected,
                const std::string& file);

}  // namespace lk::emulator
