#pragma once

#include "tools/ctl/ctl_client.hpp"

namespace lk::emulator {

/// Shows the drives repeatedly until q or Ctrl-C; once if standard output is no terminal. Returns
/// the exit status.
int watch_drives(const CtlClient& client);

}  // namespace lk::emulator
