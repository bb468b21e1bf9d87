#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "tests/host/emulator_process.hpp"

namespace lk::host {

/// An emulator that has said "lk-emu ready"; otherwise the test fails with its log.
struct ReadyEmulator : EmulatorProcess {
  explicit ReadyEmulator(const std::vector<std::string>& arguments,
                         const std::vector<std::string>& launcher = {})
      : EmulatorProcess(arguments, launcher) {
    if (!wait_ready()) throw std::runtime_error("lk-emu is not ready: " + log());
  }
};

/// Arguments for a bus and its drives, without ROM and control socket.
inline std::vector<std::string> on(const std::string& bus, const std::string& ids,
                                   const std::vector<std::string>& more = {}) {
  std::vector<std::string> all = {"--rom", ":memory:", "--control", "none",
                                  "--bus", bus,        "--ids",     ids};
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

}  // namespace lk::host
