#pragma once

#include <deque>
#include <string>
#include <vector>

#include "emulator/files/output_file.hpp"
#include "emulator/record/replay.hpp"
#include "emulator/scenario/csv_writer.hpp"

namespace lk::emulator {

/// Options of `lk-emu replay --csv`.
struct ReplayCsv {
  std::string file;
  std::vector<const Signal*> signals;
  SimTime period{0};
};

/// Writes signals of all drives of a replay, at equal steps of simulated time.
class ReplayCsvFile {
 public:
  /// Makes `replay` stop at each sample. Throws StartError.
  ReplayCsvFile(const ReplayCsv& csv, const std::vector<BusConfig>& buses, Replay& replay);
  ReplayCsvFile(const ReplayCsvFile&) = delete;
  ReplayCsvFile& operator=(const ReplayCsvFile&) = delete;
  ~ReplayCsvFile() = default;

  void commit() { file_.commit(); }

 private:
  void take(std::size_t bus, const std::vector<double>& row);

  OutputFile file_;
  std::vector<Sampler> samplers_;                      // by bus
  std::vector<std::deque<std::vector<double>>> rows_;  // by bus, as buses are not in step
  SimTime period_;
  SimTime next_row_{0};
};

}  // namespace lk::emulator
