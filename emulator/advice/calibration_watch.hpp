#pragma once

#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// A calibration (0x18) that turned a shaft which had something to carry.
class CalibrationWatch {
 public:
  /// Of the rated torque, on average over the run: friction is not in it, as it changes its sign
  /// where the shaft turns back.
  static constexpr double kShare = 0.2;

  /// The drive is to be looked at every time.
  bool runs() const { return looks_ > 0; }
  std::optional<Finding> look(const KnownDrive& drive);

 private:
  double sum_Nm_ = 0;
  int looks_ = 0;
};

}  // namespace lk::emulator
