#pragma once

/// @file Reset, boot and brown-out of the controller (docs/model.md §13).

#include <cstdint>

#include "model/drive_params.hpp"

namespace lk::model {

enum class Life : std::uint8_t { kInReset, kBooting, kAlive };

struct LifeState {
  Life life = Life::kAlive;
  double boot_left = 0;  // s
};

/// Models a reset supervisor for `T` seconds with `v_link` volts at the link. Returns true if the
/// controller came alive or died.
bool live(const LogicParams& p, double v_link, double T, LifeState& s);

}  // namespace lk::model
