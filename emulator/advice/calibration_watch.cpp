#include "emulator/advice/calibration_watch.hpp"

#include <cmath>
#include <utility>

namespace lk::emulator {
namespace {

constexpr Words kLoaded{
    "0x18 has turned the shaft while a load of {1} Nm hung on it, and the rated torque is {2} Nm",
    "0x18 转动轴时轴上有 {1} Nm 的负载，而额定转矩是 {2} Nm"};

}  // namespace

std::optional<Finding> CalibrationWatch::look(const KnownDrive& drive) {
  if (drive.calibrating) {
    sum_Nm_ += drive.torque_Nm;
    ++looks_;
    return std::nullopt;
  }
  const int looks = std::exchange(looks_, 0);
  const double load_Nm = looks > 0 ? std::abs(std::exchange(sum_Nm_, 0)) / looks : 0;
  if (drive.rated_Nm <= 0 || load_Nm <= kShare * drive.rated_Nm) return std::nullopt;
  return Finding{AdviceKind::kCalibrationUnderLoad, &kLoaded, {load_Nm, drive.rated_Nm}};
}

}  // namespace lk::emulator
