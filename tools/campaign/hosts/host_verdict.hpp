#pragma once

#include <string>

#include "emulator/files/json_table.hpp"
#include "tools/campaign/hosts/host_case.hpp"

namespace lk::emulator {

/// From what `/scenario` answers (docs/control.md), with `kind` for the name of the bus, which is
/// another one each time. Throws Json::exception.
HostVerdict host_verdict(const Json& json, const std::string& kind);

}  // namespace lk::emulator
