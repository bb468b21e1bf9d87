#pragma once

/// @file Statistics of the log of three joints, which contain chance. Emulated moves are drawn at
/// random, three at a time (bootstrap). The real figure must be within the range of 99 of 100 such
/// logs, plus a known difference.

#include <functional>
#include <string>
#include <vector>

#include "tests/fidelity/joint_log.hpp"
#include "tests/fidelity/statistics.hpp"

namespace lk::test {

inline constexpr std::size_t kJoints = 3;

struct JointFigure {
  std::string name;
  Band real;         // one number twice, or the range over the joints
  double apart = 0;  // tolerated distance from the band, in the figure's unit
  std::function<double(const JointLog&)> of;
  double widest = 0.5;  // largest width of the band, as a share of the real figure
};

/// Samples of the cruise, in dps and in LSB.
inline std::vector<double> cruise_speed(const JointLog& log) {
  return log.cruise(&JointSample::speed_dps);
}
inline std::vector<double> cruise_iq(const JointLog& log) {
  return log.cruise(&JointSample::iq_lsb);
}

const std::vector<JointFigure>& joint_figures();
Band emulated_band(const JointFigure& figure);

}  // namespace lk::test
