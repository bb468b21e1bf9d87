#pragma once

/// @file The controller between power-up and brown-out (docs/model.md §13).

#include <cstdint>

#include "model/drive_params.hpp"

namespace lk::model {

enum class Life : std::uint8_t { kInReset, kBooting, kAlive };

struct LifeState {
  Life life = Life::kAlive;
  double boot_left = 0;  // s
};

/// One period of `T` seconds with `v_link` volts at the link, as a reset supervisor compares them.
/// Returns true if the controller came alive or died.
bool live(const LogicParams& p, double v_link, double T, LifeState& s);

}  // namespace lk::model
