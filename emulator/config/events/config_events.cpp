#include "emulator/config/events/config_events.hpp"

#include <algorithm>
#include <utility>

#include "emulator/config/events/config_directives.hpp"

namespace lk::emulator {

void read_events(TableReader& reader, BusConfig& bus) {
  std::vector<std::pair<TableReader, std::string>> clears;
  std::vector<std::pair<TableReader, const FaultRow*>> faults;
  bool delays = false;
  for (auto& event : reader.tables("event")) {
    for (TimedDirective& directive : read_directives(event, bus, Timing::kRequired)) {
      if (const auto* const clear = std::get_if<ClearFault>(&directive.directive.what)) {
        clears.emplace_back(event, clear->which);
      } else if (const auto* const set = std::get_if<SetFault>(&directive.directive.what)) {
        faults.emplace_back(event, set->fault.row);
        delays = delays || delays_in_adapter(*set->fault.row);
      }
      bus.events.push_back(std::move(directive));
    }
    check_room(event, bus.events);
  }
  std::ranges::stable_sort(bus.events, {}, &TimedDirective::at);
  for (const auto& [event, which] : clears) check_clear(event, which, bus.events);
  for (const auto& [event, row] : faults) check_adapter(event, *row, bus, delays);
}

}  // namespace lk::emulator
