#pragma once

/// @file Stability margins of a drive's loops with the load on its shaft. The loops of
/// docs/internals/model.md §10 and §11 are linearised for a slow shaft that reaches no limit, and
/// opened at the current reference.

#include <complex>

#include "model/drive_params.hpp"
#include "model/setpoint.hpp"

namespace lk::emulator {

/// Gain and phase margins of the opened loop.
struct Margins {
  double gain_dB = 0;    // smaller of those to higher and lower gain; below 0: unstable
  double phase_deg = 0;  // below 0: unstable
};

/// Smaller margins count as ringing: each overshoot has about half the height of the last one
/// (assumed; designers aim at 6 dB and 30°).
inline constexpr Margins kRingingMargins{3.0, 15.0};
constexpr bool is_ringing(const Margins& m) {
  return m.gain_dB < kRingingMargins.gain_dB || m.phase_deg < kRingingMargins.phase_deg;
}

enum class Loop { kSpeed, kPosition };  // kPosition includes the speed loop

/// Returns the opened loop's frequency response at `omega`, rad/s, above 0 and below half the
/// sampling rate. Includes `drive.load`, but no backlash: the teeth of a gear touch.
std::complex<double> open_loop(const model::DriveParams& drive,
                               const model::ControlSettings& settings, Loop loop, double omega);

Margins loop_margins(const model::DriveParams& drive, const model::ControlSettings& settings,
                     Loop loop);

}  // namespace lk::emulator
