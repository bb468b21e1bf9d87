#include "tools/campaign/hosts/run_host.hpp"

#include <algorithm>
#include <exception>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "emulator/ground/start_error.hpp"
#include "tools/campaign/hosts/host_command.hpp"
#include "tools/campaign/hosts/running_case.hpp"

namespace lk::emulator {

bool HostRun::crashed(const HostSetup& setup) const {
  if (end != End::kExit) return end == End::kSignal;
  return status != 0 && std::ranges::count(setup.detecting_exit_status, status) == 0;
}

bool same(const HostRun& a, const HostRun& b) {
  return a.end == b.end && a.status == b.status && a.started_at == b.started_at &&
         a.ended_at == b.ended_at && a.notices == b.notices && a.verdict == b.verdict &&
         a.output == b.output;
}

void check_host(const HostSetup& setup, const HostCase& one) {
  if (!(setup.timeout_s > 0)) throw StartError("host: timeout_s: must be above 0");
  program_of(setup);
  HostOutput expressions(setup.detecting_lines);
  try {
    RunningCase trial(setup, one, "host: bus", -1);
    trial.start_emulator();
  } catch (const StartError& problem) {
    if (setup.bus != "vcan") throw;
    throw StartError(std::string(problem.what()) +
                     "; run the campaign under scripts/with-vcan, or say bus = \"slcan-tcp\"");
  }
}

std::optional<HostRun> run_host_case(const HostSetup& setup, const HostCase& one, int stop) {
  RunningCase running(setup, one, "case " + std::to_string(one.number), stop);
  if (!running.start_emulator()) return std::nullopt;
  return running.run_host();
}

void run_host_cases(const HostSetup& setup, unsigned jobs,
                    const std::function<std::optional<HostCase>()>& next,
                    const std::function<void(const HostCase&, const HostRun&)>& done, int stop) {
  std::mutex one_at_a_time;
  std::exception_ptr trouble;
  bool over = false;
  const auto take_next = [&]() -> std::optional<HostCase> {
    const std::lock_guard lock(one_at_a_time);
    return over ? std::nullopt : next();
  };
  const auto work = [&] {
    try {
      while (const auto one = take_next()) {
        const auto run = run_host_case(setup, *one, stop);
        const std::lock_guard lock(one_at_a_time);
        over = over || !run;
        if (run) done(*one, *run);
      }
    } catch (...) {
      const std::lock_guard lock(one_at_a_time);
      over = true;
      if (!trouble) trouble = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> workers;
    for (unsigned n = 0; n < std::max(jobs, 1U); ++n) workers.emplace_back(work);
  }
  if (trouble) std::rethrow_exception(trouble);
}

}  // namespace lk::emulator
