#pragma once

#include <sys/types.h>

#include <csignal>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace lk::host {

/// Time after which a test gives up on something that should have happened: long, since nobody
/// waits for it unless the test fails.
inline constexpr int kPatience_ms = 20'000;

/// The real program in a process of its own, with its output captured.
class EmulatorProcess {
 public:
  /// `launcher` stands before the program, e.g. {"env", "HOME=/"}; $LKEMU_LAUNCHER between the two.
  explicit EmulatorProcess(const std::vector<std::string>& arguments,
                           const std::vector<std::string>& launcher = {});
  EmulatorProcess(const EmulatorProcess&) = delete;
  EmulatorProcess& operator=(const EmulatorProcess&) = delete;
  ~EmulatorProcess();

  /// Waits for "lk-emu ready"; false when the program ended or patience did.
  bool wait_ready();
  /// Waits until the log contains `text`, so many times.
  bool wait_for_log(const std::string& text, int times = 1);
  /// What it has said on stderr, as far as somebody has waited for it.
  const std::string& log() const { return exit_.err; }
  void signal(int number) const;
  pid_t pid() const { return pid_; }

  struct Exit {
    int status = -1;  // exit status; 128 + n when signal n ended it, -1 when patience did
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

/// A launcher that makes the program another user's, who has no rights but one: to go where the
/// program lies, as only its owner may be able to.
std::vector<std::string> as_another_user();

/// The lines of /proc/PID/status, such as {"CapEff", "0000000000000000"}.
std::map<std::string, std::string> process_status(pid_t pid);

/// How often `what` is in `text`.
int count_of(const std::string& text, const std::string& what);

/// Runs a command of the system; false unless it succeeded.
bool run(const std::string& command);

}  // namespace lk::host
