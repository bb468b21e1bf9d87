#include "emulator/config_events.hpp"

#include <algorithm>
#include <utility>

#include "emulator/bus.hpp"
#include "emulator/config_directives.hpp"

namespace lk::emulator {

namespace {

/// What one bus has no room for is refused here, and not forgotten on the way.
void check_room(const TableReader& event, const std::vector<TimedDirective>& events) {
  const auto faults = std::ranges::count_if(events, [](const TimedDirective& one) {
    return std::holds_alternative<SetFault>(one.directive.what);
  });
  const auto waiting =
      std::ranges::count_if(events, [](const TimedDirective& one) { return one.when.has_value(); });
  const auto refuse = [&](const char* key, const char* what, std::size_t most) {
    event.fail(key, "a bus keeps " + std::to_string(most) + " " + what);
  };
  if (static_cast<std::size_t>(faults) > Bus::kMostFaults) {
    refuse("fault", "faults", Bus::kMostFaults);
  }
  if (static_cast<std::size_t>(waiting) > Bus::kMostWaiting) {
    refuse("when", "conditions", Bus::kMostWaiting);
  }
}

}  // namespace

void read_events(TableReader& reader, BusConfig& bus) {
  std::vector<std::pair<TableReader, std::string>> clears;
  for (auto& event : reader.tables("event")) {
    for (TimedDirective& directive : read_directives(event, bus, Timing::kRequired)) {
      if (const auto* const clear = std::get_if<ClearFault>(&directive.directive.what)) {
        clears.emplace_back(event, clear->which);
      }
      bus.events.push_back(std::move(directive));
    }
    check_room(event, bus.events);
  }
  std::ranges::stable_sort(bus.events, {}, &TimedDirective::at);
  for (const auto& [event, which] : clears) check_clear(event, which, bus.events);
}

}  // namespace lk::emulator
