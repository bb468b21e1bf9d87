#pragma once

#include <functional>
#include <optional>

#include "tools/campaign/hosts/host_case.hpp"

namespace lk::emulator {

/// Whether cases with this host can run here at all: the command is found, the bus can be had, the
/// expressions are some. `one` has the settings of any of them. Throws StartError. Call it before
/// there are threads.
void check_host(const HostSetup& setup, const HostCase& one = {});

/// Starts lk-emu on a bus of its own, the scenario, and the host beside it; waits for the host's
/// end; lets the rest of the scenario pass, and ends all that is left of both. Gives nothing when
/// `stop`, a descriptor, can be read before that; -1: never. Throws StartError when the host or
/// lk-emu cannot be started or lk-emu ends, with the number of the case. From any thread.
std::optional<HostRun> run_host_case(const HostSetup& setup, const HostCase& one, int stop = -1);

/// Runs what `next` gives, so many at once, until that gives nothing or `stop` can be read. `next`
/// and `done` are called by one thread at a time, `done` in any order. What is thrown in between is
/// thrown when all that runs has ended.
void run_host_cases(const HostSetup& setup, unsigned jobs,
                    const std::function<std::optional<HostCase>()>& next,
                    const std::function<void(const HostCase&, const HostRun&)>& done,
                    int stop = -1);

}  // namespace lk::emulator
