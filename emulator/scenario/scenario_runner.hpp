#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/scenario/sampler.hpp"
#include "emulator/core/scenario/scenario.hpp"
#include "emulator/files/output_file.hpp"
#include "emulator/scenario/frame_files.hpp"
#include "emulator/scenario/junit_writer.hpp"

namespace lk::emulator {

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
