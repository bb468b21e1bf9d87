#pragma once

#include <string>

namespace lk::emulator {

/// Reports the state to the service manager (sd_notify(3)): "READY=1". Does nothing without a
/// service manager.
void tell_service_manager(const std::string& state);

}  // namespace lk::emulator
