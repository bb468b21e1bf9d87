#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/scenario/judge.hpp"
#include "emulator/core/scenario/scenario.hpp"
#include "emulator/io/live/line.hpp"
#include "emulator/monitor/scenario/scenario_report.hpp"

namespace lk::emulator {

/// Throws std::invalid_argument if a bus of `lines` has no room for the faults of `scenario`. Pre:
/// the scenario's robot has these buses in this order.
void check_room(const Scenario& scenario, const std::vector<Line*>& lines);

/// A scenario on running buses, in addition to other hosts: executes its events on time, sends its
/// frames as a host, and checks the replies.
class LiveScenario {
 public:
  /// Starts now. Pre: `scenario.robot` describes `lines`, in this order; they outlive this object.
  /// Calls `on_over` once at the scenario's end, inside a callback of a line; do not call `finish`
  /// there. `body_failure` returns why the motion of the body is invalid; nullopt if it is valid.
  /// Throws std::invalid_argument if a bus has no room for the faults.
  LiveScenario(Scenario scenario, std::vector<Line*> lines, std::function<void()> on_over,
               std::function<std::optional<std::string>()> body_failure);
  LiveScenario(const LiveScenario&) = delete;
  LiveScenario& operator=(const LiveScenario&) = delete;
  ~LiveScenario() { finish(); }

  const Scenario& scenario() const { return scenario_; }
  bool running() const { return !final_; }
  /// Returns the result so far; the final one after `finish`.
  RunReport report() const;
  /// Ends the scenario: clears its faults, drops its pending events, and fixes the verdict.
  void finish();

 private:
  /// State for one bus.
  struct Part {
    Line* line;
    HostScript host;
    Judge judge;
    ErrorWatch errors;
    std::vector<TimedDirective> events;  // ordered by time since the start
    std::size_t next_event = 0;
    std::vector<std::string> refused = {};  // one sentence per event that found no room on the bus
    Beginning beginning;
    std::uint64_t replies = 0;       // replies of drives so far
    std::uint64_t replies_hash = 0;  // over times and contents of these replies
    // Verdict once this bus has reached the scenario's end; later events do not count.
    std::optional<Verdict> over = std::nullopt;
    SimTime over_at{0};
    Line::WatcherKey watcher{};
    Line::ListenerKey listener{};
  };

  SimTime next_due(const Part& part) const;
  void on_due(Part& part, const Bus& bus);
  void perform_due(Part& part, SimTime now);
  static void on_reply(Part& part, const TimedFrame& reply);
  Verdict verdict_of(const Part& part) const;
  /// Clears the part's faults and fixes its verdict.
  void end(Part& part);

  Scenario scenario_;
  std::function<void()> on_over_;
  std::function<std::optional<std::string>()> body_failure_;
  std::vector<std::unique_ptr<Part>> parts_;
  MonoTime began_;
  std::optional<RunReport> final_;
};

}  // namespace lk::emulator
