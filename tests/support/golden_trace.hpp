#pragma once

/// @file Golden traces: candump logs ("candump -L -x") with host frames (T) and expected replies
/// (R). The replies were written by hand from docs/reference/protocol.md; `canplayer` replays the
/// files.

#include <chrono>
#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "emulator/core/sim_time.hpp"
#include "tests/support/bus_config.hpp"
#include "tests/support/frames.hpp"

namespace lk::test {

struct GoldenTrace {
  std::vector<emulator::TimedFrame> sent;
  std::vector<emulator::TimedFrame> expected;
};

/// Reads a file with lines such as "(0.010000) vcan0 141#9A00000000000000 T".
inline GoldenTrace golden_trace(const std::string& name) {
  std::ifstream file(std::string(LKEMU_SOURCE_DIR) + "/tests/golden/" + name);
  if (!file) throw std::runtime_error("no " + name);
  GoldenTrace trace;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    char bracket = 0;
    double at_s = 0;
    std::string interface;
    std::string text;
    std::string direction;
    words >> bracket >> at_s >> bracket >> interface >> text >> direction;
    const emulator::TimedFrame timed{std::chrono::microseconds(std::llround(at_s * 1e6)),
                                     frame(text)};
    (direction == "T" ? trace.sent : trace.expected).push_back(timed);
  }
  return trace;
}

/// Returns the bus of "resting_drive.log": drive ID 1 at 45°, 25 °C and 24 V, without a bit rate.
/// 0x80 switches it off until 0x88.
inline emulator::BusConfig resting_drive() {
  emulator::BusConfig config = bus_config({1});
  config.servos[0].quirks.off_needs_run = true;
  return config;
}

}  // namespace lk::test
