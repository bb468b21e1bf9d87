#pragma once

#include "tools/campaign/plan/plan.hpp"

namespace lk::emulator {

/// Tries the ends of every dimension, for each kind of fault, before anything is run: what only a
/// case shows would come to light in the middle of a night otherwise. Other dimensions are as in
/// the plan's first case. Throws ConfigError, with the dimension and its value.
void check_ends(const Plan& plan);

}  // namespace lk::emulator
