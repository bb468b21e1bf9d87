#include "tools/cases/case_batch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>
#include <utility>

#include "emulator/core/scenario/scenario_fleet.hpp"
#include "emulator/core/scenario/scenario_text.hpp"

namespace lk::emulator {
namespace {

constexpr std::size_t kLanes = 8;  // drives in one block of a bank
constexpr std::size_t kMaxCourses = 64;
constexpr std::size_t kMaxCourseText = 1024 * 1024;  // bytes of the groups of all kept courses
// Runs take their traffic in pieces, so that memory does not grow with the length of a scenario.
constexpr SimTime kPiece = std::chrono::milliseconds(500);

/// Advances `run` to `until` and watches its traffic.
void bring_to(ScenarioRun& run, TrafficWatch& watch, SimTime until) {
  std::vector<Traffic> traffic;
  while (run.time() < until) {
    run.advance_to(std::min(until, run.time() + kPiece));
    traffic.clear();
    run.take_traffic(traffic);
    watch.observe(traffic);
  }
}

/// Returns the first drive of a fault; for a fault of the bus, the first drive on the bus.
int drive_of(const PlannedDirective& planned, const Bus& bus) {
  const auto& set = std::get<SetFault>(planned.directive.directive.what);
  if (!set.fault.ids.empty()) return set.fault.ids.front();
  int id = protocol::kMinId;
  while (!bus.has(id)) ++id;
  return id;
}

std::string state_of(const Bus& bus, int id) {
  const model::Telemetry telemetry = bus.telemetry(id);
  return telemetry.alive ? state_word(bus.servo(id).run_state_at(telemetry)) : "no power";
}

/// Returns the time up to which the cases of a group are equal: the start of the fault. A case
/// without a fault shares its whole duration, so it comes last in its group.
SimTime begin_of(const CaseRun& one) {
  return one.fault.empty() ? one.course->scenario.duration : one.fault.front().directive.at;
}

/// Stores the drive's state and last command in `one`, once `run` is just before the fault.
void note_fault(CaseRun& one, const ScenarioRun& run) {
  if (one.fault.empty() || !one.state.empty() || run.time() < begin_of(one) - SimTime{1}) return;
  const PlannedDirective& fault = one.fault.front();
  const int id = drive_of(fault, run.bus(fault.bus));
  const auto command = one.watch.command(fault.bus, id);
  one.state = state_of(run.bus(fault.bus), id);
  one.command = command ? fmt::format("{:02X}", *command) : "none";
}

}  // namespace

const CaseCourse& CaseBatch::course_of(const CaseRequest& request) {
  auto& course = courses_[request.group];
  if (!course) {
    course = std::make_unique<CaseCourse>(builder_.course(request));
    course_text_ += request.group.size();
  }
  return *course;
}

bool CaseBatch::run(std::span<const CaseRequest> requests, bool check, const Take& take) {
  if (courses_.size() > kMaxCourses || course_text_ > kMaxCourseText) {
    courses_.clear();
    course_text_ = 0;
  }
  bool all_possible = true;
  std::vector<CaseRun> cases;
  for (const CaseRequest& request : requests) {
    CaseRun one;
    try {
      one.request = &request;
      one.course = &course_of(request);
      one.fault = CaseBuilder::fault(request, one.course->scenario);
    } catch (const std::exception& problem) {
      take(impossible_json(request.number, problem.what()));
      all_possible = false;
      continue;
    }
    if (check) {
      take(possible_json(one));
    } else {
      cases.push_back(std::move(one));
    }
  }
  std::ranges::sort(cases, {}, [](const CaseRun& one) {
    return std::tuple(std::string_view(one.request->group), begin_of(one), one.request->number);
  });
  std::vector<CaseRun> mixed;  // cases of groups that fill less than half of the lanes
  for (auto first = cases.begin(); first != cases.end();) {
    const auto last = std::find_if(first, cases.end(),
                                   [&](const CaseRun& one) { return one.course != first->course; });
    if (last - first >= static_cast<std::ptrdiff_t>(kLanes / 2)) {
      run_group({first, last}, take);
    } else {
      std::move(first, last, std::back_inserter(mixed));
    }
    first = last;
  }
  for (std::size_t n = 0; n < mixed.size(); n += kLanes) {
    const auto some = std::span(mixed).subspan(n, std::min(kLanes, mixed.size() - n));
    std::vector<Start> starts;
    for (const CaseRun& one : some) starts.push_back({ScenarioRun(one.course->scenario), {}});
    run_together(some, starts);
    take(results_json(some));
  }
  return all_possible;
}

void CaseBatch::run_group(std::span<CaseRun> cases, const Take& take) const {
  Start base{ScenarioRun(cases.front().course->scenario), {}};
  for (std::size_t n = 0; n < cases.size(); n += kLanes) {
    const auto some = cases.subspan(n, std::min(kLanes, cases.size() - n));
    bring_to(base.run, base.watch, begin_of(some.front()) - SimTime{1});
    run_together(some, std::vector(some.size(), base));
    take(results_json(some));
  }
}

void CaseBatch::run_together(std::span<CaseRun> cases, const std::vector<Start>& starts) {
  std::vector<ScenarioRun> runs;
  SimTime end{0};
  std::vector<SimTime> stops;  // times just before a fault begins
  for (std::size_t n = 0; n < cases.size(); ++n) {
    CaseRun& one = cases[n];
    ScenarioRun& run = runs.emplace_back(starts[n].run);
    one.watch = starts[n].watch;
    for (const PlannedDirective& fault : one.fault) {
      run.plan(fault.bus, fault.directive);
      one.fault_name = run.bus(fault.bus).faults().back().fault.name;
    }
    end = std::max(end, one.course->scenario.duration);
    stops.push_back(begin_of(one) - SimTime{1});
  }
  ScenarioFleet fleet(std::move(runs));
  std::vector<Traffic> traffic;
  const auto look = [&] {
    for (std::size_t n = 0; n < cases.size(); ++n) {
      traffic.clear();
      fleet.take_traffic(n, traffic);
      cases[n].watch.observe(traffic);
      note_fault(cases[n], fleet.run(n));
    }
  };
  look();
  while (fleet.time() < end) {
    SimTime until = std::min(end, fleet.time() + kPiece);
    for (const SimTime stop : stops) {
      if (stop > fleet.time()) until = std::min(until, stop);
    }
    fleet.advance_to(until);
    look();
  }
  for (std::size_t n = 0; n < cases.size(); ++n) cases[n].verdict = fleet.run(n).verdict();
}

}  // namespace lk::emulator
