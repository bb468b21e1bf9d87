// Parallel runs give the results of single runs, and a copy of a run continues like the run.

#include "emulator/core/scenario/scenario_fleet.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <optional>
#include <random>
#include <sstream>
#include <string>

#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/frame_text.hpp"
#include "tests/support/serial_bus.hpp"

namespace lk::emulator {
namespace scenario_fleet_test {

using namespace std::chrono_literals;
using Random = std::mt19937;

constexpr SimTime kDuration = 250ms;

std::uint32_t below(Random& random, std::uint32_t n) {
  return static_cast<std::uint32_t>(random() % n);
}

/// A drive with every breakable part; it loses power 10 ms after its supply and boots in 20 ms.
ServoConfig breakable(ServoConfig servo, Random& random) {
  model::DriveParams& drive = servo.profile.drive;
  drive.current_sensor.noise = 0.05;
  drive.slow_sensor.v_noise = 0.02;
  drive.encoder.noise = 1e-4;
  drive.mechanics.tau_coulomb = 0.002 * (1 + below(random, 5));
  drive.mechanics.tau_static = 1.2 * drive.mechanics.tau_coulomb;
  drive.mechanics.J *= 1 + below(random, 3);
  if (below(random, 2) == 0) {
    drive.mechanics.gear_ratio = 6;
    drive.mechanics.J_out = 1e-5;
    drive.mechanics.gear_stiffness_out = 200;
    drive.mechanics.gear_damping_out = 0.1;
    drive.mechanics.backlash_out = 1e-3;
  }
  drive.brake.tau = below(random, 2) == 0 ? 0.5 : 0.0;
  drive.load.J = 1e-4 * below(random, 4);
  if (below(random, 4) == 0) drive.load.theta_max = 2;
  drive.supply.i_logic = 2;
  drive.logic = {.v_reset = 5.0, .v_reset_hysteresis = 0.5, .boot_time = 0.02};
  servo.boot_angle_deg.reset();
  servo.flash.write_time = 2ms;
  return servo;
}

FaultValue any_value(const FaultParam& param, Random& random) {
  if (!param.choices.empty()) {
    return static_cast<FaultChoice>(
        below(random, static_cast<std::uint32_t>(param.choices.size())));
  }
  const double value = param.min + (param.max - param.min) * below(random, 256) / 255.0;
  return param.whole ? std::round(value) : value;
}

/// Returns a fault of kind `row` in the middle of the run, or nothing if these drives cannot have
/// it.
std::optional<TimedDirective> fault_event(const FaultRow& row, const BusConfig& bus,
                                          Random& random) {
  if (row.serial && !bus.serial) return std::nullopt;
  Fault fault = fault_of(row);
  if (!row.of_bus) fault.ids = {bus.servos.front().id};
  for (std::size_t n = 0; n < row.params.size() && !row.params[n].word.empty(); ++n) {
    fault.values[n] = any_value(row.params[n], random);
  }
  if (row.word == "load_step" || row.word == "kick") {
    fault.values[0] = fault.values[0].number() / 1000;
  }
  if (row.impossible != nullptr && !row.impossible(fault, bus.servos.front()).empty()) {
    return std::nullopt;
  }
  if (row.per_frame) fault.probability = 0.7;
  if (!row.momentary()) fault.duration = 1ms * (5 + below(random, 100));
  if (below(random, 3) == 0) fault.every = 120ms;
  // At a whole millisecond, together with other events.
  return TimedDirective{1ms * (60 + below(random, 100)), {kWholeBus, SetFault{fault}}};
}

BusConfig can_bus(std::size_t n, Random& random) {
  constexpr std::array kGenerations{Generation::kLegacy, Generation::kLateLegacy, Generation::kV235,
                                    Generation::kV236};
  BusConfig bus = test::bus_config({}, n % 5 == 0 ? 0 : 1'000'000);
  const int drives = 1 + static_cast<int>(below(random, 3));
  for (int id = 1; id <= drives; ++id) {
    const Generation generation = kGenerations[below(random, kGenerations.size())];
    bus.servos.push_back(breakable(test::drive(generation, Series::kMg, id), random));
    if (id == 2) bus.servos.back().profile.drive.inverter.f_pwm = 24'000;
  }
  if (n % 7 == 3) bus.adapter = &adapter_profiles().front();
  return bus;
}

BusConfig serial_bus(Random& random) {
  std::vector<ServoConfig> drives;
  for (int id = 1; id <= 2; ++id) {
    drives.push_back(breakable(test::serial_drive(Generation::kV236, id), random));
  }
  return test::serial_bus(std::move(drives));
}

void add_sends(Scenario& scenario, std::size_t bus, Random& random) {
  const BusConfig& config = scenario.robot[bus];
  for (const ServoConfig& servo : config.servos) {
    const auto format = protocol::wire_format(servo.quirks.dialect, servo.profile.series);
    const auto send = [&](const protocol::Command& command, SimTime at, SimTime every,
                          std::uint64_t times) {
      protocol::Frame frame = protocol::encode_query(servo.id, command, format);
      scenario.sends.push_back({bus, at, frame, every, times});
    };
    send(protocol::Speed{90.0 + 50.0 * below(random, 20)}, 1ms * (25 + below(random, 10)), 70ms, 3);
    send(protocol::ReadState2{}, 700us, 1ms * (1 + below(random, 5)), 60);
    send(protocol::ReadState1{}, 3ms, 10ms, 20);
    if (below(random, 4) == 0) send(protocol::ClearErrors{}, 150ms, 1ms, 3);
    // More frames than the hosts' queue holds.
    if (below(random, 4) == 0) send(protocol::ReadMultiTurnAngle{}, 100ms, 10us, 1500);
  }
}

void add_events(BusConfig& bus, Random& random) {
  const int id = bus.servos.back().id;
  switch (below(random, 5)) {
    case 0:
      bus.events.push_back({40ms, {id, PowerCycle{20ms}}, std::nullopt});
      bus.events.push_back({140ms, {id, PowerCycle{1ms}}, std::nullopt});
      break;
    case 1:
      bus.events.push_back({0ms, {id, PowerOff{}}, std::nullopt});
      bus.events.push_back({55ms, {id, PowerOn{}}, std::nullopt});
      break;
    case 2:
      bus.events.push_back({50ms, {id, Sag{2.0, 15ms}}, std::nullopt});
      bus.events.push_back({70ms, {id, SupplyVoltage{30, 20ms}}, std::nullopt});
      break;
    case 3:
      bus.events.push_back(
          {60ms,
           {id, TurnShaft{10}},
           Condition{id, SignalReaches{find_signal("speed_dps"), Edge::kAbove, 50}}});
      break;
    default:
      bus.events.push_back({100ms, {id, AmbientTemperature{60}}, std::nullopt});
  }
}

/// Returns the n-th scenario, with different robots, buses, hosts, events and expectations.
Scenario scenario(std::size_t n) {
  Random random(static_cast<std::uint32_t>(n));
  Scenario scenario;
  scenario.duration = kDuration;
  if (n % 3 == 0) {
    scenario.robot = {serial_bus(random)};
  } else {
    scenario.robot = {can_bus(n, random)};
  }
  if (n % 4 == 1) {
    scenario.robot.push_back(can_bus(n + 1, random));
    scenario.robot.back().interface = "other";
  }
  for (std::size_t bus = 0; bus < scenario.robot.size(); ++bus) {
    scenario.robot[bus].seed = n + 1;
    add_events(scenario.robot[bus], random);
    add_sends(scenario, bus, random);
  }
  const Replies few{.max_count = 50};
  scenario.expectations = {
      {0,
       1,
       SignalWithin{find_signal("speed_dps"), {-2000, 2000}},
       {Period::Kind::kThroughout, 10ms, 200ms},
       ""},
      {0, 1, ErrorIs{model::Error::kStall, true}, {Period::Kind::kBy, 10ms, 240ms}, ""},
      {0, 1, few, {Period::Kind::kThroughout, 0ms, 250ms}, ""}};
  return scenario;
}

/// Returns a fault of kind `row` as the last event, or nothing if its drives cannot have it.
std::optional<TimedDirective> fault_for(const FaultRow& row, const Scenario& scenario) {
  Random random(static_cast<std::uint32_t>(&row - fault_table().data()));
  return fault_event(row, scenario.robot.front(), random);
}

/// Returns the index of a scenario whose first bus can have a fault of this kind.
std::size_t place_for(std::size_t kind) { return fault_table()[kind].serial ? 3 * kind : kind; }

Scenario scenario_with(std::size_t kind) {
  Scenario result = scenario(place_for(kind));
  if (auto fault = fault_for(fault_table()[kind], result)) {
    result.robot.front().events.push_back(*fault);
  }
  return result;
}

void write(std::ostream& out, const std::vector<Traffic>& traffic) {
  for (const Traffic& one : traffic) {
    out << one.bus << (one.from_host ? " > " : " < ") << one.frame.at.count() << ' '
        << frame_text(one.frame.frame) << '\n';
  }
}

void write(std::ostream& out, const Bus& bus) {
  const auto bits = [&](auto... values) {
    ((out << ' ' << std::bit_cast<std::uint64_t>(double{values})), ...);
    out << '\n';
  };
  for (int id = 1; id <= 3; ++id) {
    if (!bus.has(id)) continue;
    const model::Truth truth = bus.truth(id);
    bits(truth.theta_m, truth.omega_m, truth.theta_out, truth.i_d, truth.i_q, truth.v_bus,
         truth.temp_winding, truth.temp_stage, truth.i_q_ref, truth.omega_ref, truth.theta_ref);
    const model::Telemetry telemetry = bus.telemetry(id);
    bits(telemetry.v_bus, telemetry.i_a, telemetry.omega, telemetry.temp_motor);
    out << telemetry.errors << telemetry.alive << telemetry.bridge_on << ' ' << bus.servo(id).starts
        << '\n';
  }
  for (const FaultReport& report : bus.faults()) {
    const FaultEvidence& evidence = report.evidence;
    out << report.fault.name << ' ' << static_cast<int>(evidence.state) << ' '
        << evidence.armed_at.count() << ' ' << evidence.began_at.value_or(-1ns).count() << ' '
        << evidence.first_effect_at.value_or(-1ns).count() << ' ' << evidence.effects << ' '
        << evidence.first_on << '\n';
  }
  const BusStats stats = bus.stats();
  out << stats.frames << ' ' << stats.queries << ' ' << stats.replies << ' ' << stats.replies_lost
      << ' ' << stats.replies_waiting << ' ' << stats.extra_frames << ' ' << stats.error_frames
      << ' ' << stats.queue_peak << ' ' << stats.wire_busy.count() << '\n';
}

/// Returns all observable results of a run.
std::string results_of(const ScenarioRun& run, const std::vector<Traffic>& traffic) {
  std::ostringstream out;
  write(out, traffic);
  for (std::size_t bus = 0; bus < run.size(); ++bus) write(out, run.bus(bus));
  const Verdict verdict = run.verdict();
  out << static_cast<int>(verdict.outcome) << '\n';
  for (const ExpectationResult& result : verdict.expectations) out << result.measured << '\n';
  for (const std::string& why : verdict.invalid) out << why << '\n';
  return out.str();
}

/// Advances a run to its end and returns its results.
std::string finish(ScenarioRun run) {
  run.advance_to(kDuration);
  std::vector<Traffic> traffic;
  run.take_traffic(traffic);
  return results_of(run, traffic);
}

std::string alone(const Scenario& scenario) { return finish(ScenarioRun(scenario)); }

/// Returns scenarios with faults of eight kinds, far apart in the table.
std::vector<Scenario> batch(std::size_t first, std::size_t step) {
  std::vector<Scenario> scenarios;
  for (std::size_t kind = first; kind < fault_table().size(); kind += step) {
    scenarios.push_back(scenario_with(kind));
  }
  return scenarios;
}

ScenarioFleet fleet_of(const std::vector<Scenario>& scenarios) {
  return ScenarioFleet(std::vector<ScenarioRun>(scenarios.begin(), scenarios.end()));
}

std::string results_of(ScenarioFleet& fleet, std::size_t n) {
  std::vector<Traffic> traffic;
  fleet.take_traffic(n, traffic);
  return results_of(fleet.run(n), traffic);
}

TEST(ScenarioFleet, GivesTheResultsOfSingleRuns) {
  const std::size_t batches = (fault_table().size() + 7) / 8;
  std::size_t with_fault = 0;
  for (std::size_t first = 0; first < batches; ++first) {
    const std::vector<Scenario> scenarios = batch(first, batches);
    ScenarioFleet fleet = fleet_of(scenarios);
    fleet.advance_to(kDuration);
    for (std::size_t n = 0; n < fleet.size(); ++n) {
      SCOPED_TRACE(fault_table()[first + n * batches].word);
      EXPECT_EQ(results_of(fleet, n), alone(scenarios[n]));
      with_fault += fleet.run(n).bus(0).faults().size();
    }
  }
  EXPECT_GE(with_fault, fault_table().size() - 3) << "drives of these tests have nearly all";
}

TEST(ScenarioFleet, ResultsDoNotDependOnSlices) {
  const std::vector<Scenario> scenarios = batch(2, 8);
  ScenarioFleet whole = fleet_of(scenarios);
  whole.advance_to(kDuration);
  ScenarioFleet sliced = fleet_of(scenarios);
  while (sliced.time() < kDuration) {
    sliced.advance_to(std::min<SimTime>(sliced.time() + 370us, kDuration));
  }
  for (std::size_t n = 0; n < whole.size(); ++n) {
    EXPECT_EQ(results_of(sliced, n), results_of(whole, n)) << n;
  }
}

TEST(ScenarioFleet, AcceptsFramesOfAnotherHost) {
  const std::vector<Scenario> scenarios = batch(1, 8);
  const TimedFrame query{90ms + 123us, test::frame("141#9200000000000000")};
  ScenarioFleet fleet = fleet_of(scenarios);
  fleet.receive(3, 0, query);
  fleet.advance_to(kDuration);
  for (std::size_t n = 0; n < fleet.size(); ++n) {
    ScenarioRun run(scenarios[n]);
    if (n == 3) run.receive(0, query);
    EXPECT_EQ(results_of(fleet, n), finish(run)) << n;
  }
}

TEST(ScenarioFleet, CopiedRunContinuesAlone) {
  const std::vector<Scenario> scenarios = batch(3, 8);
  std::optional<ScenarioFleet> fleet = fleet_of(scenarios);
  fleet->advance_to(101ms);
  std::vector<ScenarioRun> copies;
  for (std::size_t n = 0; n < fleet->size(); ++n) copies.push_back(fleet->run(n));
  fleet->advance_to(kDuration);
  for (std::size_t n = 0; n < fleet->size(); ++n) {
    EXPECT_EQ(results_of(*fleet, n), finish(copies[n])) << n;
  }
}

/// Campaigns compute the common part of several cases once.
TEST(ScenarioRun, LaterPlannedFaultActsLikeOneFromTheStart) {
  for (std::size_t kind = 0; kind < fault_table().size(); ++kind) {
    SCOPED_TRACE(fault_table()[kind].word);
    const Scenario without = scenario(place_for(kind));
    const auto fault = fault_for(fault_table()[kind], without);
    if (!fault) continue;
    ScenarioRun common(without);
    common.advance_to(fault->at - 1ns);
    ScenarioRun run = common;
    ASSERT_TRUE(run.plan(0, *fault));
    EXPECT_EQ(finish(run), alone(scenario_with(kind)));
  }
}

/// As above, for eight runs with a common beginning.
TEST(ScenarioFleet, PlansFaultsOfRunsWithACommonBeginning) {
  const Scenario without = scenario(9);
  ScenarioRun common(without);
  common.advance_to(50ms);
  std::vector<TimedDirective> faults;
  for (const FaultRow& row : fault_table()) {
    if (auto fault = fault_for(row, without)) faults.push_back(*fault);
  }
  ASSERT_FALSE(faults.empty());
  ScenarioFleet fleet(std::vector<ScenarioRun>(faults.size(), common));
  for (std::size_t n = 0; n < faults.size(); ++n) ASSERT_TRUE(fleet.plan(n, 0, faults[n]));
  fleet.advance_to(kDuration);
  for (std::size_t n = 0; n < faults.size(); ++n) {
    Scenario with = without;
    with.robot.front().events.push_back(faults[n]);
    EXPECT_EQ(results_of(fleet, n), alone(with)) << n;
  }
}

}  // namespace scenario_fleet_test
}  // namespace lk::emulator
