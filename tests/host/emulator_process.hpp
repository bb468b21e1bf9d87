#pragma once

#include <sys/types.h>

#include <csignal>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace lk::host {

/// Time-out for expected events. Long, because only a failing test waits for it.
inline constexpr int kPatience_ms = 20'000;

/// The real program as a process, with captured output.
class EmulatorProcess {
 public:
  /// `launcher` precedes the program, e.g. {"env", "HOME=/"}; $LKEMU_LAUNCHER comes in between.
  explicit EmulatorProcess(const std::vector<std::string>& arguments,
                           const std::vector<std::string>& launcher = {});
  EmulatorProcess(const EmulatorProcess&) = delete;
  EmulatorProcess& operator=(const EmulatorProcess&) = delete;
  ~EmulatorProcess();

  /// Waits for "lk-emu ready"; returns false if the program ends or time runs out.
  bool wait_ready();
  /// Waits until the log contains `text` `times` times.
  bool wait_for_log(const std::string& text, int times = 1);
  /// Returns the stderr output read so far.
  const std::string& log() const { return exit_.err; }
  void signal(int number) const;
  pid_t pid() const { return pid_; }

  struct Exit {
    int status = -1;  // exit status; 128 + n if signal n ended it, -1 on time-out
    std::string out;
    std::string err;
  };
  Exit wait();
  Exit stop(int number = SIGTERM);

 private:
  bool pump_until(const std::function<bool()>& done);

  pid_t pid_ = -1;
  int out_fd_ = -1;
  int err_fd_ = -1;
  Exit exit_;
};

/// A program that is ready; the constructor throws if it does not get there.
class StartedEmulator : public EmulatorProcess {
 public:
  explicit StartedEmulator(const std::vector<std::string>& arguments,
                           const std::vector<std::string>& launcher = {});
};

/// Expects that the program refuses its input: status 2, this error, and no other output.
void expect_refused(EmulatorProcess&& emulator, const std::string& error);

/// Returns a launcher that runs the program as another user without capabilities, except for access
/// to the program's directory.
std::vector<std::string> as_another_user();

/// Returns the lines of /proc/PID/status, such as {"CapEff", "0000000000000000"}.
std::map<std::string, std::string> process_status(pid_t pid);

/// Returns the number of occurrences of `what` in `text`.
int count_of(const std::string& text, const std::string& what);

/// Returns the text of a file; empty if there is none.
std::string text_of(const std::string& file);

/// Runs a shell command; returns whether it succeeded.
bool run(const std::string& command);

}  // namespace lk::host
