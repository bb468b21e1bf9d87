#pragma once

/// Terminal settings with any bit rate: Linux's termios2, whose header conflicts with the C
/// library's.

#include <cstdint>

#include "emulator/core/terminal_flag.hpp"

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
/// Returns the settings that change bytes in transit. Throws std::system_error.
TerminalFlags flags_of(int fd);
/// Sets raw mode: bytes unchanged, no flow control, 8 bits, no parity, 1 stop bit. Rate 0 keeps the
/// current rate. Throws std::system_error.
void make_raw(int fd, std::int64_t rate);

}  // namespace lk::emulator
