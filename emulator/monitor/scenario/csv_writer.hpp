#pragma once

#include <cstddef>
#include <deque>
#include <filesystem>
#include <string>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/scenario/sampler.hpp"
#include "emulator/core/servo/signals.hpp"
#include "emulator/core/sim_time.hpp"
#include "emulator/files/output_file.hpp"

namespace lk::emulator {

/// Finds signals of drives and of the body by name. `body`: null if the robot has no body. Throws
/// StartError for an unknown name.
std::vector<const Signal*> find_signals(const std::vector<std::string>& names,
                                        const BodySignals* body);

/// Returns the time between rows at --rate. Throws StartError if the rate is out of range.
SimTime row_period(double rate_Hz);

/// Writes signals at equal steps of simulated time. Buses may be sampled at different times: a row
/// is written once all buses have it. `n` is the index of a bus.
class CsvFile {
 public:
  /// `ids`: drives whose signals are written; empty: all. Signals of the body are sampled with the
  /// first bus. Throws StartError.
  CsvFile(const std::filesystem::path& file, const std::vector<BusConfig>& buses,
          const std::vector<const Signal*>& signals, const std::vector<int>& ids, SimTime period);

  SimTime next_due(std::size_t n) const { return samplers_[n].next_due(); }
  /// Samples a bus. Pre: the time of `bus` is next_due(n).
  void sample(std::size_t n, const Bus& bus);
  void commit() { file_.commit(); }

 private:
  OutputFile file_;
  std::vector<Sampler> samplers_;                      // by bus
  std::vector<std::deque<std::vector<double>>> rows_;  // by bus: waiting for other buses
  SimTime period_;
  SimTime next_row_{0};
};

}  // namespace lk::emulator
