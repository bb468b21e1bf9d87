#pragma once

#include <optional>

#include "emulator/advice/advice.hpp"
#include "emulator/advice/heard.hpp"

namespace lk::emulator {

/// Detects a calibration (0x18) with a load on the shaft.
class CalibrationWatch {
 public:
  /// Share of the rated torque, averaged over the run. Friction cancels out, as its sign changes
  /// when the shaft turns back.
  static constexpr double kShare = 0.2;

  /// Returns true if the drive must be looked at every time.
  bool runs() const { return looks_ > 0; }
  std::optional<Finding> look(const KnownDrive& drive);

 private:
  double sum_Nm_ = 0;
  int looks_ = 0;
};

}  // namespace lk::emulator
