#pragma once

#include <cstdint>
#include <vector>

namespace lk::emulator {

/// Terminal settings that change or add bytes (termios(3)).
enum class TerminalFlag : std::uint8_t { kIcrnl, kInlcr, kIgncr, kIstrip, kIxon, kOpost, kEcho };
using TerminalFlags = std::vector<TerminalFlag>;

}  // namespace lk::emulator
