#pragma once

/// @file Conversions between the units of the wire and of the model.

#include <numbers>

namespace lk::emulator {

inline constexpr double kRadPerDeg = std::numbers::pi / 180.0;

constexpr double rad_s_from_dps(double speed_dps) { return speed_dps * kRadPerDeg; }
constexpr double dps_from_rad_s(double omega_rad_s) { return omega_rad_s / kRadPerDeg; }

}  // namespace lk::emulator
