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

/// What `lk-emu run` writes besides its summary.
struct RunOutputs {
  struct Csv {
    std::filesystem::path file;
    std::vector<std::string> signals = {"angle_deg", "speed_dps", "iq_A"};
    std::vector<int> ids;  // empty: all
    SimTime period{0};
  };
  std::optional<Csv> csv;
  FrameOutputs frames;
  std::optional<std::filesystem::path> rom;  // directory; absent: ROM ends with the run
  bool progress = false;                     // on standard error
  bool strict = false;                       // advice is a failure
};

/// Runs a scenario as fast as the machine goes. Throws StartError when an output cannot be written.
RunReport run_scenario(Scenario scenario, const RunOutputs& outputs);

}  // namespace lk::emulator
