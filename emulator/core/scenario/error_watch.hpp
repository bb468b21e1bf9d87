#pragma once

#include <vector>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/scenario/judge.hpp"

namespace lk::emulator {

/// First time at which an error bit of a drive was set.
struct FirstError {
  int id = 1;
  model::Error error = model::Error::kUnderVoltage;
  SimTime at{0};  // since the start
  friend bool operator==(const FirstError&, const FirstError&) = default;
};

/// Samples the error bits of all drives of a bus, as often as a Judge does.
class ErrorWatch {
 public:
  ErrorWatch(const BusConfig& config, SimTime start);

  SimTime next_due() const { return next_due_; }
  void look(const Bus& bus);
  /// In the order of time; at equal times by drive, then by bit.
  const std::vector<FirstError>& firsts() const { return firsts_; }

 private:
  struct Watched {
    int id = 1;
    model::ErrorBits seen{};
  };
  SimTime start_;
  SimTime next_due_;
  std::vector<Watched> drives_;
  std::vector<FirstError> firsts_;
};

}  // namespace lk::emulator
