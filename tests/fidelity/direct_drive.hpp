#pragma once

/// @file The log of a direct drive with a 14-bit encoder and legacy firmware, 0xA1 and 0xA2 every
/// 1.25 ms. It has 36 slots and 42 poles; type, gains and supply are unknown. The emulated drive is
/// an MF7015-23T at factory gains, but with 42 poles.

#include <cstdint>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::test {

/// Measured iq over the command of 0xA1: the least and the largest of the log's four steps.
struct LoggedTorque {
  double after_ms, low, high;
};
inline const std::vector<LoggedTorque> kLoggedTorque{{3, 0.11, 0.19},  {6, 0.09, 0.25},
                                                     {10, 0.19, 0.32}, {15, 0.33, 0.40},
                                                     {20, 0.28, 0.54}, {30, 0.36, 0.52}};
/// Reported speed every 2.5 ms, from the command of 573 dps on.
inline const std::vector<double> kLoggedStart_dps{0,   76,  296, 556, 819, 954,
                                                  616, 411, 352, 385, 503, 619};

emulator::ServoConfig logged_drive();
/// Returns the drive of a specimen for each seed, 200 ms after power-up.
Host logged_specimen(std::uint64_t seed, double J_load_kg_m2 = 0);
/// Returns iq over the command at these times after it. The result is the mean of steps to 50, 100
/// and 150 LSB from a standstill at 8 positions. Pre: `after_ms` is sorted.
std::vector<double> torque_shares(const std::vector<double>& after_ms);

}  // namespace lk::test
