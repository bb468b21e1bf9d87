#pragma once

#include <string>

namespace lk::emulator {

/// Returns a bus that needs no CAN in the kernel, with instructions to connect that can be copied.
std::string offer_without_can();
/// Returns a suggestion for this machine when no bus was given.
std::string bus_offer();

}  // namespace lk::emulator
