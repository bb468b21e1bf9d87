#pragma once

#include <chrono>
#include <string>

#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// A progress line on standard error, shown after one second.
class Progress {
 public:
  Progress(std::string name, SimTime duration, bool wanted);
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress();  // erases the line

  void show(SimTime now);
  double wall_s() const;

 private:
  std::string name_;
  SimTime duration_;
  bool wanted_;
  bool shown_ = false;
  std::chrono::steady_clock::time_point began_;
  std::chrono::steady_clock::time_point next_;
};

}  // namespace lk::emulator
