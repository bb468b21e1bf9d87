#include "emulator/scenario/csv_options.hpp"

#include <cmath>

#include "emulator/config/config_reader.hpp"
#include "emulator/ground/start_error.hpp"

namespace lk::emulator {

std::vector<const Signal*> find_signals(const std::vector<std::string>& names) {
  std::vector<std::string> known;
  for (const Signal& signal : signals()) known.emplace_back(signal.name);
  std::vector<const Signal*> found;
  for (const std::string& name : names) {
    found.push_back(find_signal(name));
    if (found.back() != nullptr) continue;
    const std::string meant = nearest(name, known);
    throw StartError("--signals: no signal \"" + name + "\"" +
                     (meant.empty() ? "" : ", did you mean " + meant + "?"));
  }
  return found;
}

SimTime row_period(double rate_Hz) {
  constexpr double kMost_Hz = 1e6;
  if (!(rate_Hz >= 1e-3 && rate_Hz <= kMost_Hz)) {
    throw StartError("--rate: must be 0.001 to 1000000 Hz");
  }
  return SimTime(std::llround(1e9 / rate_Hz));
}

}  // namespace lk::emulator
