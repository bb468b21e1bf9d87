#include "emulator/record/replay_csv.hpp"

#include <algorithm>

namespace lk::emulator {
namespace {

/// Samples a bus and passes the rows on.
template <class Take>
struct RowLook {
  Sampler& sampler;
  Take take;
  std::vector<double> row = {};

  SimTime next_due() const { return sampler.next_due(); }
  void look(const Bus& bus) {
    sampler.look(bus, row);
    take(row);
  }
};
template <class Take>
RowLook(Sampler&, Take) -> RowLook<Take>;  // required by Clang 14

}  // namespace

ReplayCsvFile::ReplayCsvFile(const ReplayCsv& csv, const std::vector<BusConfig>& buses,
                             Replay& replay)
    : file_(csv.file, "--csv"), rows_(buses.size()), period_(csv.period) {
  std::vector<std::string> names;
  for (const BusConfig& bus : buses) {
    std::vector<SampledColumn> columns;
    for (const ServoConfig& servo : bus.servos) {
      for (const Signal* signal : csv.signals) columns.push_back({servo.id, signal});
    }
    samplers_.emplace_back(std::move(columns), SimTime{0}, csv.period);
    names.push_back(bus.interface);
  }
  file_.write(csv_header(names, samplers_));
  replay.advance = [this, &replay](std::size_t n, SimTime until) {
    RowLook look{samplers_[n], [this, n](const std::vector<double>& row) { take(n, row); }};
    advance_watched(replay.bus(n), until, look);
  };
}

void ReplayCsvFile::take(std::size_t bus, const std::vector<double>& row) {
  rows_[bus].push_back(row);
  std::vector<double> all;
  while (std::ranges::none_of(rows_, [](const auto& waiting) { return waiting.empty(); })) {
    all.clear();
    for (auto& waiting : rows_) {
      all.insert(all.end(), waiting.front().begin(), waiting.front().end());
      waiting.pop_front();
    }
    file_.write(csv_row(next_row_, all));
    next_row_ += period_;
  }
}

}  // namespace lk::emulator
