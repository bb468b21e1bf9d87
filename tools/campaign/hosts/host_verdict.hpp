#pragma once

#include "emulator/files/json_table.hpp"
#include "tools/campaign/hosts/host_case.hpp"

namespace lk::emulator {

/// From what `/scenario` answers (docs/control.md). Throws Json::exception.
HostVerdict host_verdict(const Json& json);

}  // namespace lk::emulator
