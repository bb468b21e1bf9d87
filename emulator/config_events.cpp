#include "emulator/config_events.hpp"

#include <algorithm>

#include "emulator/config_directives.hpp"

namespace lk::emulator {

void read_events(TableReader& reader, BusConfig& bus) {
  for (auto& event : reader.tables("event")) {
    for (TimedDirective& directive : read_directives(event, bus, Timing::kRequired)) {
      bus.events.push_back(std::move(directive));
    }
  }
  std::ranges::stable_sort(bus.events, {}, &TimedDirective::at);
}

}  // namespace lk::emulator
