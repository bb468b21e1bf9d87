#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "emulator/control/control_api.hpp"

namespace lk::emulator {

/// Replaces each %XX by its byte. Throws ApiError, which names `part` of the request.
std::string decode_percent(std::string_view text, const char* part);

/// Removes "http://HOST" of an absolute target (RFC 9112, 3.2.2) from `target`. Returns HOST, which
/// replaces the header's; nullopt for "/path".
std::optional<std::string_view> take_authority(std::string_view& target);

/// Parses "/path?key=value&…" into `request`; its path stays encoded. Throws ApiError.
void read_target(std::string_view target, ApiRequest& request);

}  // namespace lk::emulator
