#pragma once

#include <cstdint>

#include "model/drive_params.hpp"

namespace lk::emulator {

/// Changes the texture of a motor type to that of one specimen, drawn from `random`: strength and
/// phase of the cogging, direction and size of the current sensors' offset, and phase of the
/// encoder's error (docs/internals/model.md §15).
void draw_specimen(std::uint64_t random, model::DriveParams& drive);

}  // namespace lk::emulator
