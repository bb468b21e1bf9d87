#pragma once

#include <cstdint>
#include <vector>

namespace lk::emulator {

/// Settings of a terminal that change bytes on their way, or add some (termios(3)).
enum class TerminalFlag : std::uint8_t { kIcrnl, kInlcr, kIgncr, kIstrip, kIxon, kOpost, kEcho };
using TerminalFlags = std::vector<TerminalFlag>;

}  // namespace lk::emulator
