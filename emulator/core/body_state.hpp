#pragma once

/// @file Observable state of a body: plain values.

#include <array>
#include <vector>

namespace lk::emulator {

using Triple = std::array<double, 3>;
using Quaternion = std::array<double, 4>;  // w x y z

/// State of a part of a body at an instant, in world axes.
struct PartState {
  Triple position_m{};   // of the origin of the part's frame
  Triple rpy_rad{};      // rotation about the world's x, then y, then z
  Triple speed_m_s{};    // of the origin of the part's frame
  double contact_N = 0;  // sum of the normal forces of its contacts
};

struct BodyState {
  std::vector<PartState> parts;  // indexed as Mechanism::parts()
  double contact_N = 0;          // sum of the normal forces between moving parts and the world
  // A part other than the end of a limb touches the world, or the free part is tilted by more than
  // kFallen_deg. Always false for a body without a free part.
  bool fallen = false;
};
inline constexpr double kFallen_deg = 60;  // assumed: no gait tilts a trunk this far

}  // namespace lk::emulator
