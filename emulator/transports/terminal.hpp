#pragma once

/// @file What a terminal is set to, odd bit rates included: Linux's termios2, whose header does not
/// go together with that of the C library.

#include <cstdint>

#include "emulator/ground/terminal_flag.hpp"

namespace lk::emulator {

/// Settings that both ends of a line must share. Linux removes PARENB and CS7 from a
/// pseudo-terminal (pty_set_termios) but keeps PARODD, so even parity and 7 bits cannot be seen.
struct LineSettings {
  std::int64_t rate = 0;  // bit/s, of what is written
  bool two_stop_bits = false;
  bool odd_parity = false;
};
/// Settings of the slave side; `fd` is the master of the pseudo-terminal. Throws std::system_error.
LineSettings line_settings_of(int fd);
/// What of its settings changes bytes on their way. Throws std::system_error.
TerminalFlags flags_of(int fd);
/// Nothing of it is changed on its way, and no one waits: 8 bits, no parity, 1 stop bit. A rate of
/// 0 leaves that as it is. Throws std::system_error.
void make_raw(int fd, std::int64_t rate);

}  // namespace lk::emulator
