#pragma once

/// @file The rule for the texture of a motor: cogging, torque ripple and errors of the current
/// sensors (docs/internals/model.md §15).

#include "model/drive_params.hpp"

namespace lk::emulator {

/// Size of a motor as its label gives it ("4015": 40 mm by 15 mm), and its slots.
struct Stator {
  int slots = 0;
  double diameter = 0, height = 0;  // m
};

/// Sets the texture of a typical specimen. Pre: pole pairs, gear and sensor range are set.
void set_texture(const Stator& stator, model::DriveParams& drive);

}  // namespace lk::emulator
