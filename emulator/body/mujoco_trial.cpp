#include "emulator/body/mujoco_trial.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <fstream>
#include <new>
#include <stdexcept>
#include <system_error>

#include "emulator/core/text.hpp"

namespace lk::emulator {
namespace {

// Limits of the child process; assumed: models of real robots need a hundredth of each.
constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 30U;
constexpr int kMax_s = 60;
constexpr int kTooLong = 2;  // exit status

volatile std::sig_atomic_t seconds_left = kMax_s;

/// Ends the process when its time is used up. Installed without SA_RESTART: the signal also makes a
/// blocking system call fail, e.g. on a pipe without a writer.
void on_second(int /*signal*/) {
  seconds_left = seconds_left - 1;
  if (seconds_left <= 0) ::_exit(kTooLong);
}

/// Limits the address space of this process to its present size plus kMaxBytes.
void bound_memory() {
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  rlimit limit{};
  ::getrlimit(RLIMIT_AS, &limit);
  const rlim_t most = pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)) + kMaxBytes;
  if (limit.rlim_cur > most) limit.rlim_cur = most;
  ::setrlimit(RLIMIT_AS, &limit);
}

void bound_time() {
  struct sigaction action {};
  action.sa_handler = on_second;
  ::sigaction(SIGALRM, &action, nullptr);
  const itimerval each_second{{1, 0}, {1, 0}};
  ::setitimer(ITIMER_REAL, &each_second, nullptr);
}

std::string problem_of(const std::string& file, void (*load)(const std::string&)) {
  try {
    load(file);
    return "";
  } catch (const std::bad_alloc&) {
    return file + ": needs more than 1 GiB of memory";
  } catch (const std::exception& problem) {
    return problem.what();
  }
}

[[noreturn]] void run_child(int report, const std::string& file, void (*load)(const std::string&)) {
  bound_memory();
  bound_time();
  const std::string problem = problem_of(file, load);
  // A message of one line fits into the pipe, so `write` does not block.
  if (!problem.empty() && ::write(report, problem.data(), problem.size()) < 0) ::_exit(kTooLong);
  ::_exit(problem.empty() ? 0 : 1);
}

std::string read_all(int descriptor) {
  std::string text;
  std::array<char, 4096> piece{};
  for (;;) {
    const ssize_t size = ::read(descriptor, piece.data(), piece.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return text;
    text.append(piece.data(), static_cast<std::size_t>(size));
  }
}

int wait_for(pid_t child) {
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

}  // namespace

void try_in_child(const std::string& file, void (*load)(const std::string& file)) {
  const auto fail = [&](const std::string& why) { throw std::invalid_argument(file + ": " + why); };
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) fail(std::generic_category().message(errno));
  const pid_t child = ::fork();
  const int fork_error = errno;
  if (child == 0) run_child(ends[1], file, load);
  ::close(ends[1]);
  const std::string problem = child > 0 ? sanitized_line(read_all(ends[0])) : "";
  ::close(ends[0]);
  if (child < 0) fail("fork failed: " + std::generic_category().message(fork_error));
  const int status = wait_for(child);
  if (!problem.empty()) throw std::invalid_argument(problem);
  if (WIFSIGNALED(status)) fail("MuJoCo fails: signal " + std::to_string(WTERMSIG(status)));
  if (WEXITSTATUS(status) != 0) fail("takes longer than " + std::to_string(kMax_s) + " s to load");
}

}  // namespace lk::emulator
