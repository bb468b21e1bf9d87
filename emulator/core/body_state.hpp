#pragma once

/// @file What can be watched of a body: plain values.

#include <array>
#include <vector>

namespace lk::emulator {

using Triple = std::array<double, 3>;
using Quaternion = std::array<double, 4>;  // w x y z

/// A part of a body at an instant, in the axes of the world.
struct PartState {
  Triple position_m{};   // of the part's own frame
  Triple rpy_rad{};      // turned about the world's x, then y, then z
  Triple speed_m_s{};    // of that frame's origin
  double contact_N = 0;  // normal forces of all that touches it, summed
};

struct BodyState {
  std::vector<PartState> parts;  // of Mechanism::parts()
  double contact_N = 0;          // normal forces between what moves and the world, summed
  // Something else of it than the ends of its limbs touches the world, or the part that goes where
  // it likes has tilted by more than kFallen_deg. Never of a body that is fixed.
  bool fallen = false;
};
inline constexpr double kFallen_deg = 60;  // assumed: no gait tilts a trunk by as much

}  // namespace lk::emulator
