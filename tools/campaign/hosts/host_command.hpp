#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/campaign/hosts/case_keeper.hpp"
#include "tools/campaign/hosts/host_bus.hpp"
#include "tools/campaign/hosts/host_case.hpp"

namespace lk::emulator {

/// The host's arguments with the values of a case in place of {…}. Throws StartError at one of
/// {host.NAME} that the case does not have.
std::vector<std::string> filled_in(const HostSetup& setup, const HostCase& one, const HostBus& bus,
                                   const std::string& control);

/// The file that the first word of the command is: by PATH, or where it has a slash from the
/// directory that the host runs in. Throws StartError when there is none that can be run.
std::string program_of(const HostSetup& setup);

/// `control` is where a stepped host finds the clock; else empty.
Program host_program(const HostSetup& setup, const HostCase& one, const HostBus& bus,
                     const std::string& control);
/// On that bus, controlled at `control`.
Program emulator_program(const HostSetup& setup, const HostCase& one, const HostBus& bus,
                         const std::string& control);

}  // namespace lk::emulator
