#pragma once

#include <string>

#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// Returns all shipped profiles as a table, one line each (`lk-emu motors`). Throws ConfigError.
std::string list_motors();

/// Returns one profile with its derived figures (`lk-emu motors NAME`).
std::string describe_motor(const Profile& profile);

}  // namespace lk::emulator
