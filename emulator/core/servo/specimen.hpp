#pragma once

#include <cstdint>

#include "model/drive_params.hpp"

namespace lk::emulator {

/// Changes the texture of a motor type to that of one specimen (docs/internals/model.md §15). Draws
/// these from `random`: strength of the cogging, offset of the current sensors, and phase of the
/// encoder's error. A detent of the cogging is at `theta_m` [rad], where the rotor rests. With
/// friction, the rotor can also rest beside the detent.
void draw_specimen(std::uint64_t random, double theta_m, model::DriveParams& drive);

}  // namespace lk::emulator
