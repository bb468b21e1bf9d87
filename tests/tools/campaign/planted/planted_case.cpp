#include "tests/tools/campaign/planted/planted_case.hpp"

#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "emulator/config/scenario/scenario_file.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "tests/support/profile.hpp"

namespace lk::emulator::planted {
namespace {

constexpr double kKgM2PerGCm2 = 1e-7;

SimTime seconds(double time_s) {
  return SimTime{static_cast<SimTime::rep>(std::llround(time_s * 1e9))};
}

std::string text_of(const std::string& file) {
  std::ifstream in(file);
  if (!in) throw std::invalid_argument("cannot read " + file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

const ScenarioFiles& files() {
  static const ScenarioFiles files{
      .robot =
          [](const std::string& name, const Overrides& overrides) {
            const std::string file =
                std::string(LKEMU_SOURCE_DIR) + "/tests/tools/campaign/planted/" + name;
            return parse_config(text_of(file), file, overrides, test::profile);
          },
      .text = text_of,
  };
  return files;
}

[[noreturn]] void no_such(const std::string& name) {
  throw std::invalid_argument("a planted case has no " + name);
}

double number(const Values& values, const std::string& name, double fallback) {
  const auto found = values.find(name);
  return found == values.end() ? fallback : std::get<double>(found->second);
}

/// What the parameter is set to: its word by its place among the choices, or the number.
FaultValue fault_value(const FaultParam& param, const std::variant<double, std::string>& value) {
  const auto* word = std::get_if<std::string>(&value);
  if (word == nullptr) return std::get<double>(value);
  const auto found = std::ranges::find(param.choices, *word);
  if (found == param.choices.end()) no_such(*word);
  return static_cast<FaultChoice>(found - param.choices.begin());
}

Fault fault_in(const Values& values, const std::string& kind) {
  const FaultRow* row = find_fault(kind);
  if (row == nullptr) no_such(kind);
  Fault fault = fault_of(*row);
  fault.name = kind;
  if (!row->of_bus) fault.ids = {1};
  for (std::size_t n = 0; n < row->params.size() && !row->params[n].word.empty(); ++n) {
    const std::string name = "fault." + kind + "." + std::string(row->params[n].word);
    const auto found = values.find(name);
    if (found != values.end()) fault.values[n] = fault_value(row->params[n], found->second);
  }
  if (row->per_frame) fault.probability = number(values, "fault.probability", 1);
  if (!row->momentary() && values.contains("fault.for_s")) {
    fault.duration = seconds(number(values, "fault.for_s", 0));
  }
  return fault;
}

void set_world(BusConfig& bus, const std::string& name, double value) {
  model::DriveParams& drive = bus.servos.front().profile.drive;
  if (name == "seed") {
    bus.seed = static_cast<std::uint64_t>(value);
  } else if (name == "supply_V") {
    drive.supply.v_source = value;
  } else if (name == "ambient_C") {
    drive.thermal.temp_ambient = value;
  } else if (name == "load.J_g_cm2") {
    drive.load.J = value * kKgM2PerGCm2;
  } else if (name == "load.tau_gravity_Nm") {
    drive.load.tau_gravity = value;
  } else {
    no_such(name);
  }
}

/// In widths of the range; a bound that is alone counts from 0.
double margin_of(const Range& range, double value) {
  const double width = std::isinf(range.min)   ? std::abs(range.max)
                       : std::isinf(range.max) ? std::abs(range.min)
                                               : range.max - range.min;
  const double margin = std::min(value - range.min, range.max - value) / width;
  return std::isfinite(margin) ? margin : -1;
}

}  // namespace

Scenario base_scenario(const Bug& bug) {
  return parse_scenario(bug.scenario, bug.name + ".toml", std::nullopt, files());
}

PlantedCase case_of(const Scenario& base, const Values& values) {
  PlantedCase result{base, {}};
  BusConfig& bus = result.scenario.robot.front();
  for (const auto& [name, value] : values) {
    if (name.starts_with("fault.")) continue;
    if (name.starts_with("host.")) {
      result.host[name.substr(5)] = std::get<double>(value);
    } else {
      set_world(bus, name, std::get<double>(value));
    }
  }
  const auto kind = values.find("fault.kind");
  if (kind == values.end()) return result;
  const Fault fault = fault_in(values, std::get<std::string>(kind->second));
  const TimedDirective planned{.at = seconds(number(values, "fault.at_s", 0)),
                               .directive = {kWholeBus, SetFault{fault}}};
  const auto place = std::ranges::upper_bound(bus.events, planned.at, {}, &TimedDirective::at);
  bus.events.insert(place, planned);
  return result;
}

MarginWatch::MarginWatch(const Scenario& scenario) {
  for (const Expectation& expectation : scenario.expectations) {
    if (!std::holds_alternative<SignalWithin>(expectation.what)) continue;
    const bool by = expectation.when.kind == Period::Kind::kBy;
    watched_.push_back({&expectation, by ? -std::numeric_limits<double>::infinity()
                                         : std::numeric_limits<double>::infinity()});
  }
}

void MarginWatch::look(const Bus& bus) {
  const SimTime now = bus.time();
  for (Watched& one : watched_) {
    const Period& when = one.expectation->when;
    const SimTime from = when.kind == Period::Kind::kAt ? when.to : when.from;
    if (now < from || now > when.to) continue;
    const auto& within = std::get<SignalWithin>(one.expectation->what);
    const double margin =
        margin_of(within.range, within.signal->read(bus.view(one.expectation->id)));
    one.margin = when.kind == Period::Kind::kBy ? std::max(one.margin, margin)
                                                : std::min(one.margin, margin);
  }
}

double MarginWatch::margin() const {
  double worst = std::numeric_limits<double>::infinity();
  for (const Watched& one : watched_) worst = std::min(worst, one.margin);
  return std::isfinite(worst) ? worst : 1;
}

}  // namespace lk::emulator::planted
