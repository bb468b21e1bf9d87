#pragma once

/// @file What a terminal is set to, odd bit rates included: Linux's termios2, whose header does not
/// go together with that of the C library.

#include <cstdint>

#include "emulator/ground/terminal_flag.hpp"

namespace lk::emulator {

/// What was written to it goes out at this rate, bit/s; of a pseudo-terminal's master: what the
/// other side has set. Throws std::system_error.
std::int64_t output_rate(int fd);
/// What of its settings changes bytes on their way. Throws std::system_error.
TerminalFlags flags_of(int fd);
/// Nothing of it is changed on its way, and no one waits: 8 bits, no parity, 1 stop bit. A rate of
/// 0 leaves that as it is. Throws std::system_error.
void make_raw(int fd, std::int64_t rate);

}  // namespace lk::emulator
