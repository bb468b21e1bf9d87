#pragma once

#include <string>
#include <string_view>

#include "emulator/control/control_api.hpp"

namespace lk::emulator {

/// Replaces each %XX by its byte. Throws ApiError about `part` of the request.
std::string decode_percent(std::string_view text, const char* part);

/// Takes "/path?key=value&…" apart into `request`; its path stays encoded. Throws ApiError.
void read_target(std::string_view target, ApiRequest& request);

}  // namespace lk::emulator
