#include "emulator/scenario/csv_writer.hpp"

#include <charconv>

#include "emulator/core/scenario/scenario_text.hpp"

namespace lk::emulator {

std::string csv_header(const std::vector<std::string>& buses,
                       const std::vector<Sampler>& samplers) {
  std::string text = "time_s";
  for (std::size_t n = 0; n < samplers.size(); ++n) {
    for (const SampledColumn& column : samplers[n].columns()) {
      text += ',';
      const bool of_body = column.signal->is_of_body();
      if (!of_body && buses.size() > 1) text += buses[n] + '.';
      if (!of_body) text += std::to_string(column.id) + '.';
      text += column.signal->name;
    }
  }
  return text + '\n';
}

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

}  // namespace lk::emulator
