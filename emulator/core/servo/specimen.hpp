#pragma once

#include <cstdint>

#include "model/drive_params.hpp"

namespace lk::emulator {

/// Turns the cogging so that a rotor at `theta_m` [rad] rests in a detent, as a rotor at power-up
/// does.
void rest_in_detent(double theta_m, model::DriveParams& drive);

/// Changes the texture of a motor type to that of one specimen (docs/internals/model.md §15).
/// Draws from `random`: strength of the cogging, direction and size of the current sensors' offset,
/// phases of the encoder's error. The phase of the cogging moves as far as friction holds the
/// rotor.
void draw_specimen(std::uint64_t random, model::DriveParams& drive);

}  // namespace lk::emulator
