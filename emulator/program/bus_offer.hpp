#pragma once

#include <string>

namespace lk::emulator {

/// The bus that needs no CAN in the kernel, and how hosts get on it, ready to be copied.
std::string offer_without_can();
/// What this machine offers when no bus was given.
std::string bus_offer();

}  // namespace lk::emulator
