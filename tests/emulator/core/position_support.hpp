#pragma once

/// @file Tolerances of the tests of position commands.

#include "tests/support/test_bus.hpp"

namespace lk::test {

inline constexpr double kCount_cdeg = 36000.0 / 16384;
// One count from the target, which is up to half a count from one.
inline constexpr double kArrived_cdeg = 1.5 * kCount_cdeg;

/// Returns the shaft's angle after the motion, in 0.01°.
inline double rest_cdeg(Host& host) {
  host.wait(2s);
  return static_cast<double>(host.multi_turn_cdeg());
}

inline protocol::Frame query(const protocol::Command& command) {
  return protocol::encode_query(1, command, protocol::kLegacyFormat);
}

}  // namespace lk::test
