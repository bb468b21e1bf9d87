#pragma once

#include <string>

namespace lk::emulator {

/// Tells the service manager that started this process how it goes (sd_notify(3)): "READY=1".
/// Without one, and where it does not listen, nothing happens.
void tell_service_manager(const std::string& state);

}  // namespace lk::emulator
