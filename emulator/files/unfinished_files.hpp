#pragma once

namespace lk::emulator {

/// Makes SIGHUP, SIGINT and SIGTERM remove the file before they end the program, unless they have
/// another handler. `path` must stay valid until `keep_if_ended`. At most eight files; others are
/// not removed.
void remove_if_ended(const char* path);
void keep_if_ended(const char* path);

}  // namespace lk::emulator
