#pragma once

#include <string_view>

#include "emulator/control/control_api.hpp"

namespace lk::emulator {

/// Takes "/path?key=value&…" apart into `request`. Throws ApiError.
void read_target(std::string_view target, ApiRequest& request);

}  // namespace lk::emulator
