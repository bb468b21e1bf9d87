#include "emulator/monitor/scenario/csv_writer.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "emulator/config/config_reader.hpp"
#include "emulator/core/scenario/scenario_text.hpp"
#include "emulator/core/start_error.hpp"

namespace lk::emulator {

std::vector<const Signal*> find_signals(const std::vector<std::string>& names,
                                        const BodySignals* body) {
  const std::vector<const Signal*> all = signals_with(body);
  std::vector<std::string> known;
  for (const Signal* const signal : all) known.emplace_back(signal->name);
  std::vector<const Signal*> found;
  for (const std::string& name : names) {
    const auto place = std::ranges::find(all, name, &Signal::name);
    if (place != all.end()) {
      found.push_back(*place);
      continue;
    }
    if (name.starts_with(kBodyPrefix) && body == nullptr) {
      throw StartError("--signals: " + name + ": the robot has no [body]");
    }
    const std::string meant = closest_match(name, known);
    throw StartError("--signals: no signal \"" + name + "\"" +
                     (meant.empty() ? "" : ", did you mean " + meant + "?"));
  }
  return found;
}

SimTime row_period(double rate_Hz) {
  constexpr double kMax_Hz = 1e6;
  if (!(rate_Hz >= 1e-3 && rate_Hz <= kMax_Hz)) {
    throw StartError("--rate: must be 0.001 to 1000000 Hz");
  }
  return SimTime(std::llround(1e9 / rate_Hz));
}

namespace {

/// Returns the columns by bus. The body's signals are with the first bus.
std::vector<std::vector<SampledColumn>> csv_columns(const std::vector<BusConfig>& buses,
                                                    const std::vector<const Signal*>& signals,
                                                    const std::vector<int>& ids) {
  std::vector<std::vector<SampledColumn>> all(buses.size());
  for (std::size_t n = 0; n < buses.size(); ++n) {
    for (const ServoConfig& servo : buses[n].servos) {
      if (!ids.empty() && std::ranges::find(ids, servo.id) == ids.end()) continue;
      for (const Signal* const signal : signals) {
        if (!signal->is_of_body()) all[n].push_back({servo.id, signal});
      }
    }
  }
  for (const Signal* const signal : signals) {
    if (signal->is_of_body()) all.front().push_back({buses.front().servos.front().id, signal});
  }
  return all;
}

/// Returns "time_s,1.speed_dps,body.fallen,…"; with several buses, the bus precedes the ID.
std::string csv_header(const std::vector<BusConfig>& buses, const std::vector<Sampler>& samplers) {
  std::string text = "time_s";
  for (std::size_t n = 0; n < samplers.size(); ++n) {
    for (const SampledColumn& column : samplers[n].columns()) {
      text += ',';
      const bool of_body = column.signal->is_of_body();
      if (!of_body && buses.size() > 1) text += buses[n].interface + '.';
      if (!of_body) text += std::to_string(column.id) + '.';
      text += column.signal->name;
    }
  }
  return text + '\n';
}

/// Returns a line: time in nanoseconds, and the shortest numbers that parse to the same bits.
std::string csv_row(SimTime time, const std::vector<double>& values) {
  std::string text = seconds_text(time);
  for (const double value : values) {
    char buffer[32];
    const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
    text += ',';
    text.append(buffer, end);
  }
  return text + '\n';
}

}  // namespace

CsvFile::CsvFile(const std::filesystem::path& file, const std::vector<BusConfig>& buses,
                 const std::vector<const Signal*>& signals, const std::vector<int>& ids,
                 SimTime period)
    : file_(file, "--csv"), rows_(buses.size()), period_(period) {
  for (auto& columns : csv_columns(buses, signals, ids)) {
    samplers_.emplace_back(std::move(columns), SimTime{0}, period);
  }
  file_.write(csv_header(buses, samplers_));
}

void CsvFile::sample(std::size_t n, const Bus& bus) {
  samplers_[n].sample(bus, rows_[n].emplace_back());
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
