#pragma once

#include <poll.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/campaign/hosts/case_keeper.hpp"
#include "tools/campaign/hosts/control_relay.hpp"
#include "tools/campaign/hosts/host_bus.hpp"
#include "tools/campaign/hosts/host_case.hpp"
#include "tools/campaign/hosts/host_output.hpp"
#include "tools/ctl/ctl_client.hpp"

namespace lk::emulator {

/// A directory of one case, gone with it. Its name leaves room for the path of a socket.
class CaseDirectory {
 public:
  CaseDirectory();
  CaseDirectory(const CaseDirectory&) = delete;
  CaseDirectory& operator=(const CaseDirectory&) = delete;
  ~CaseDirectory();
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// What somebody reads of what a process writes.
struct Pipe {
  Pipe();
  Descriptor from, to;
};

/// One case: its directory, its bus, its processes.
class RunningCase {
 public:
  /// Starts nothing. Throws StartError, as all of this does; `name` says of which case it is.
  RunningCase(const HostSetup& setup, const HostCase& one, std::string name, int stop);

  /// Until lk-emu can answer. Returns false when `stop` came first.
  bool start_emulator();
  /// Begins the scenario, starts the host, waits for its end, and lets the rest of the scenario
  /// pass.
  std::optional<HostRun> run_host();

 private:
  using WallTime = std::chrono::steady_clock::time_point;

  bool wait(WallTime deadline);
  void take_events();
  void take_output();
  void begin_scenario(const std::string& toml);
  bool wait_for_host(HostRun& run);
  void end_others();
  void finish_scenario(HostRun& run);
  SimTime now() const;
  Json ask(const char* method, const std::string& path, const Json& body = nullptr) const;
  [[noreturn]] void fail(const std::string& why) const;
  std::string last_words(const std::string& what) const;

  const HostSetup& setup_;
  const HostCase& case_;
  std::string name_;
  int stop_;
  CaseDirectory directory_;
  HostBus bus_;
  HostOutput output_;
  Pipe said_, host_said_;
  bool host_silent_ = false;  // nothing more will come
  bool ready_ = false, stopped_ = false, others_ended_ = false;
  std::string ready_text_;
  std::optional<int> host_ended_;  // what wait() gave
  CtlClient control_;
  double started_s_ = 0;  // the scenario, in the time of the clock
  std::optional<ControlRelay> relay_;
  std::vector<pollfd> waits_;
  std::optional<CaseKeeper> keeper_;  // last: all that runs ends first
};

}  // namespace lk::emulator
