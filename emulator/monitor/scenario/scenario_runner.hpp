#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "emulator/config/scenario/config_scenario.hpp"
#include "emulator/core/bus_config.hpp"
#include "emulator/core/scenario/sampler.hpp"
#include "emulator/core/scenario/scenario.hpp"
#include "emulator/core/sim_time.hpp"
#include "emulator/files/output_file.hpp"
#include "emulator/monitor/scenario/scenario_report.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// Limits for files of a scenario, in bytes.
struct FileLimits {
  std::uintmax_t each = kLongestLog;
  std::uintmax_t played = std::numeric_limits<std::uintmax_t>::max();  // of all logs together
  bool no_logs = false;  // refuse to play logs: this would reveal which files exist
};

/// Returns functions that load the files of one scenario. Paths are relative to `directory`, that
/// of the scenario file. A robot is a path or the name of a shipped robot. The returned object
/// counts the bytes of logs for FileLimits::played, so use one per scenario.
ScenarioFiles scenario_files(const std::filesystem::path& directory, FileLimits limits = {});

// `given` is a path or a shipped name (meant_file). Throw StartError.
Scenario load_scenario(const std::string& given, std::optional<std::uint64_t> seed);
/// As load_scenario(), for buses that already run: the scenario's own robot is not used.
Scenario load_live_scenario(const std::string& given, const std::vector<BusConfig>& running,
                            FileLimits limits = {});

/// Files for the frames of a run.
struct FrameOutputs {
  std::optional<std::filesystem::path> candump;
  bool marks = false;  // end candump lines with T or R (direction); Wireshark cannot read these
  std::optional<std::filesystem::path> capture;  // pcapng
};

/// Writes every frame of hosts and drives to files.
class FrameFiles {
 public:
  /// Throws StartError if a file cannot be written.
  FrameFiles(const FrameOutputs& outputs, std::span<const BusConfig> buses);
  void write(std::size_t bus, SimTime at, const protocol::Frame& frame, bool from_host);
  void commit();

 private:
  std::vector<std::string> buses_;
  bool marks_;
  std::optional<OutputFile> candump_;
  std::optional<OutputFile> capture_;
};

/// Outputs of `lk-emu run` besides its summary.
struct RunOutputs {
  struct Csv {
    std::filesystem::path file;
    std::vector<std::string> signals = {"angle_deg", "speed_dps", "iq_A"};
    std::vector<int> ids;  // empty: all
    SimTime period{0};
  };
  std::optional<Csv> csv;
  FrameOutputs frames;
  std::optional<std::filesystem::path> rom;  // directory; absent: ROM is not saved
  bool progress = false;                     // on standard error
  bool strict = false;                       // advice counts as a failure
};

/// Runs a scenario as fast as possible. Throws StartError if an output cannot be written.
RunReport run_scenario(Scenario scenario, const RunOutputs& outputs);

}  // namespace lk::emulator
