#pragma once

/// @file What the log of three joints amounts to: sums over a log, which chance is in. The emulated
/// moves are drawn from at random, three at a time (bootstrap); the real figure has to be where 99
/// of 100 such logs have theirs. Where it is not, the difference is known.

#include <functional>
#include <string>
#include <vector>

#include "tests/fidelity/joint_log.hpp"
#include "tests/fidelity/statistics.hpp"

namespace lk::test {

inline constexpr std::size_t kJoints = 3;

struct JointFigure {
  std::string name;
  Band real;         // one number twice, or what the joints have
  double apart = 0;  // in the figure's unit: how much further away the band may be
  std::function<double(const JointLog&)> of;
  double widest = 0.5;  // of the real figure: so far from end to end may the band be
};

/// What is summarised of the cruise, in dps and in LSB.
inline std::vector<double> cruise_speed(const JointLog& log) {
  return log.cruise(&JointSample::speed_dps);
}
inline std::vector<double> cruise_iq(const JointLog& log) {
  return log.cruise(&JointSample::iq_lsb);
}

const std::vector<JointFigure>& joint_figures();
Band emulated_band(const JointFigure& figure);

}  // namespace lk::test
