#pragma once

/// @file How far a drive's loops are from ringing with what hangs on its shaft: the loops of
/// docs/model.md §10 and §11, linearised about a shaft that turns slowly without touching a limit,
/// and cut open at the current reference.

#include <complex>

#include "model/drive_params.hpp"
#include "model/setpoint.hpp"

namespace lk::emulator {

/// Factor and turn of the phase that the opened loop may take before it rings for ever.
struct Margins {
  double gain_dB = 0;    // to either side; below 0: it does
  double phase_deg = 0;  // below 0: it does
};

/// Less than this is called ringing: an overshoot by half of what is left, again and again
/// (assumed; 6 dB and 30° are what a designer leaves).
inline constexpr Margins kRings{3.0, 15.0};
constexpr bool rings(const Margins& m) {
  return m.gain_dB < kRings.gain_dB || m.phase_deg < kRings.phase_deg;
}

enum class Loop { kSpeed, kPosition };  // the latter with the speed loop inside

/// The opened loop at an angular frequency, rad/s, above 0 and below that of half a sample.
/// `drive.load` counts; the play of a gear does not, its teeth touch.
std::complex<double> open_loop(const model::DriveParams& drive,
                               const model::ControlSettings& settings, Loop loop, double omega);

Margins loop_margins(const model::DriveParams& drive, const model::ControlSettings& settings,
                     Loop loop);

}  // namespace lk::emulator
