#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/scenario/error_watch.hpp"
#include "emulator/core/scenario/host_script.hpp"
#include "emulator/core/scenario/judge.hpp"
#include "emulator/core/scenario/scenario.hpp"
#include "emulator/live/line.hpp"
#include "emulator/scenario/junit_writer.hpp"

namespace lk::emulator {

/// Throws std::invalid_argument when a bus of `lines` has no room for the faults of `scenario`,
/// whose robot is what runs on them, in that order.
void check_room(const Scenario& scenario, const std::vector<Line*>& lines);

/// A scenario on buses that run already, beside whatever hosts there are: does what it has planned
/// when its time comes, puts its frames on the buses as if a host had, and listens.
class LiveScenario {
 public:
  /// Begins now. `scenario.robot` is what runs on `lines`, in that order; they outlive this.
  /// `on_over` is called once, from a line, when the scenario has come to its end; `finish` is to
  /// be called after that, not from there. `body_failure` says why what the body does means nothing
  /// any more, where it does not. Throws std::invalid_argument when a bus cannot take so many
  /// faults.
  LiveScenario(Scenario scenario, std::vector<Line*> lines, std::function<void()> on_over,
               std::function<std::optional<std::string>()> body_failure);
  LiveScenario(const LiveScenario&) = delete;
  LiveScenario& operator=(const LiveScenario&) = delete;
  ~LiveScenario() { finish(); }

  const Scenario& scenario() const { return scenario_; }
  bool running() const { return !final_; }
  /// So far; at the end once it is finished.
  RunReport report() const;
  /// Ends it: its faults are cleared, what it had planned is not done, the verdict stands.
  void finish();

 private:
  /// On one bus.
  struct Part {
    Line* line;
    HostScript host;
    Judge judge;
    ErrorWatch errors;
    std::vector<TimedDirective> events;  // by time, since the beginning
    std::size_t next_event = 0;
    std::vector<std::string> refused = {};  // events that found no room, a sentence each
    Beginning beginning;
    std::uint64_t replies = 0;  // of drives, so far
    std::uint64_t replies_hash = 0;
    // How it stood when it was over; what comes later is not the scenario's.
    std::optional<Verdict> over = std::nullopt;
    SimTime over_at{0};
    Line::WatcherKey watcher{};
    Line::ListenerKey listener{};
  };

  SimTime next_due(const Part& part) const;
  void look(Part& part, const Bus& bus);
  void perform_due(Part& part, SimTime now);
  static void hear(Part& part, const TimedFrame& reply);
  Verdict verdict_of(const Part& part) const;
  /// Its faults are cleared, its verdict stands.
  void end(Part& part);

  Scenario scenario_;
  std::function<void()> on_over_;
  std::function<std::optional<std::string>()> body_failure_;
  std::vector<std::unique_ptr<Part>> parts_;
  MonoTime began_;
  std::optional<RunReport> final_;
};

}  // namespace lk::emulator
