#pragma once

#include <vector>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/scenario/judge.hpp"

namespace lk::emulator {

/// When an error bit of a drive was first set.
struct FirstError {
  int id = 1;
  model::Error error = model::Error::kUnderVoltage;
  SimTime at{0};  // since the beginning
  friend bool operator==(const FirstError&, const FirstError&) = default;
};

/// Looks at the error bits of all drives of a bus, as often as a Judge does.
class ErrorWatch {
 public:
  ErrorWatch(const BusConfig& config, SimTime start);

  SimTime next_due() const { return next_due_; }
  void look(const Bus& bus);
  /// In the order in which they were set; of one instant by drive, then by bit.
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
