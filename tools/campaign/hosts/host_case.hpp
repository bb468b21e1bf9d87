#pragma once

/// @file A case of a campaign with a real host: what to run, and what came of it. Plain values.

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// The host program of a campaign.
struct HostSetup {
  /// The program and its arguments. In each, {bus}, {channel}, {port}, {control}, {case} and
  /// {host.NAME} are replaced (docs/campaign-hosts.md).
  std::vector<std::string> command;
  std::string bus = "slcan-tcp";  // a kind of bus, one of host_bus_kinds()
  bool stepped = false;           // the host moves the clock; else time is real
  double timeout_s = 60;          // from its start to its end, on the wall clock; above 0
  // What says that the host has noticed: any of these statuses, or a line of its output in which
  // one of these expressions (ECMAScript) is found.
  std::vector<int> detecting_exit_status;
  std::vector<std::string> detecting_lines;
  std::filesystem::path directory;  // that the host runs in; empty: this process's
  std::filesystem::path program;    // lk-emu; empty: the program that runs
};

struct HostCase {
  std::uint64_t number = 0;  // {case}
  /// What happens and what is expected (docs/scenarios.md). Names of files in it are absolute, or
  /// of shipped ones. Its keys seed and bitrate do not count, those below do.
  std::string scenario_toml;
  std::string robot;  // file, or the name of a shipped one, with one bus; empty: one drive, 1
  std::optional<std::uint64_t> seed;
  std::optional<std::int64_t> bitrate;
  std::optional<std::string> generation;
  std::map<std::string, std::string> host_values;  // {host.NAME}
};

/// What came of an expectation; times since the scenario began.
struct HostExpectation {
  std::string says, expected, measured;
  bool passed = false;
  std::optional<SimTime> decided_at;
  std::optional<double> margin;  // as CaseResult has it
  friend bool operator==(const HostExpectation&, const HostExpectation&) = default;
};
struct HostFault {
  std::string name, kind;
  std::optional<SimTime> began_at, first_effect_at;
  std::uint64_t effects = 0;
  std::string first_on;
  friend bool operator==(const HostFault&, const HostFault&) = default;
};
/// The first instant at which an error bit was set.
struct HostError {
  int id = 1;
  std::string error;  // "stall"
  SimTime at{0};
  friend bool operator==(const HostError&, const HostError&) = default;
};
struct HostVerdict {
  std::string outcome;  // "passed", "failed", "invalid"
  std::vector<HostExpectation> expectations;
  std::vector<HostFault> faults;
  std::vector<HostError> errors;  // in order of time
  std::vector<std::string> invalid;
  // What drives have sent: frames, and a number that is the same when they have sent the same at
  // the same times. Of use when time is stepped.
  std::uint64_t replies = 0;
  std::string replies_hash;
  friend bool operator==(const HostVerdict&, const HostVerdict&) = default;
};

/// The host has said that something is wrong.
struct HostNotice {
  SimTime at{0};         // since the scenario began; may be after its end
  std::string text;      // the line, cut at kLongestNotice; or "exit status 3"
  std::size_t rule = 0;  // which of the expressions, from 1; 0: its exit status
  std::string gist;      // what another run says too, when it says the same: gist_of(), or `text`
  friend bool operator==(const HostNotice&, const HostNotice&) = default;
};
inline constexpr std::size_t kLongestNotice = 500;   // bytes
inline constexpr std::size_t kMostNotices = 1000;    // that are kept
inline constexpr std::size_t kLongestOutput = 4096;  // bytes that are kept of its end

struct HostRun {
  enum class End : std::uint8_t {
    kExit,
    kSignal,
    kTimeout,  // it hung, and was killed
  };
  End end = End::kExit;
  int status = 0;  // exit status, or the signal
  // Since the scenario began: the scenario comes first, by less than a millisecond on a machine
  // that has time. Stepped: 0.
  SimTime started_at{0};
  SimTime ended_at{0};              // since the scenario began; may be after its end
  std::vector<HostNotice> notices;  // in order of time, the first of each gist
  HostVerdict verdict;
  std::string output;  // the end of what it said
  double wall_s = 0;   // from its start to its end
  // Drives' time that was left out because the machine had too much to do (docs/control.md): what
  // has come late then need not be the host's fault. Stepped: 0.
  double slipped_s = 0;

  /// It came to no end of its own that the setup knows: a signal, or an exit status that is
  /// neither 0 nor a detecting one.
  bool crashed(const HostSetup& setup) const;
};
/// All but wall_s.
bool same(const HostRun& a, const HostRun& b);

}  // namespace lk::emulator
