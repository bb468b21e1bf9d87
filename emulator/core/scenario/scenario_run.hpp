#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/coupling/coupling.hpp"
#include "emulator/core/scenario/judge.hpp"
#include "emulator/core/scenario/scenario.hpp"

namespace lk::emulator {

enum class Outcome : std::uint8_t {
  kPassed,
  kFailed,   // an expectation failed
  kInvalid,  // no result: a planned event had no effect, or the run ended too early
};

/// A planned fault and its outcome.
struct PlannedFault {
  std::string bus;  // interface
  FaultReport report;
  bool took_effect() const { return report.evidence.effects > 0; }
};

/// Unasked motion with the largest distance of all drives.
struct WorstMotion {
  std::string bus;  // interface
  int id = 0;
  UnaskedMotion motion{};  // times since the scenario began; `number` 0: none

  /// Keeps `other` if its distance is larger.
  void take(const WorstMotion& other) {
    if (other.motion.deg > motion.deg) *this = other;
  }
};

struct Verdict {
  Outcome outcome = Outcome::kPassed;
  std::vector<ExpectationResult> expectations;
  std::vector<PlannedFault> faults;
  std::vector<std::string> invalid;  // reasons, one sentence each
  WorstMotion unasked{};
};

/// State of a bus when a scenario began on it.
struct Beginning {
  SimTime start{0};
  std::size_t faults = 0;  // number of faults armed before
  std::size_t unmet = 0;   // number of directives that waited for a condition then
};

/// Adds the expectations and faults of one bus to `verdict`, with their results so far.
void add_to_verdict(const Judge& judge, const Bus& bus, const std::string& interface,
                    const Beginning& beginning, Verdict& verdict);
/// Sets the outcome, after all buses were added.
void conclude(Verdict& verdict);

/// A frame on one of the buses.
struct Traffic {
  std::size_t bus = 0;
  TimedFrame frame;
  bool from_host = false;
};

/// A scenario that runs on buses of its own, in simulated time. All buses advance together. A copy
/// continues from the same state, independently.
class ScenarioRun {
 public:
  explicit ScenarioRun(const Scenario& scenario);

  SimTime time() const { return time_; }
  void advance_to(SimTime until);
  /// A host other than the scenario's puts `in.frame` on the bus `index` at `in.at`, or now if that
  /// is past. Advances the run to that time.
  void receive(std::size_t index, const TimedFrame& in);
  /// Adds an event to the bus `index`, as if it were the last one of the scenario. Pre: its time is
  /// not past. Returns false without effect if there is no room for another fault or condition.
  bool plan(std::size_t index, const TimedDirective& event) {
    return lines_[index].bus.plan_as_configured(event);
  }
  std::size_t size() const { return lines_.size(); }
  const Bus& bus(std::size_t index) const { return lines_[index].bus; }
  /// Appends the frames since the last call, in order of time. A host's frame has the time at which
  /// the host sent it; TimedFrame::at tells the time of a drive's frame.
  void take_traffic(std::vector<Traffic>& out);
  /// Appends the ROM writes of drives since the last call.
  void take_rom_writes(std::size_t index, std::vector<RomWrite>& out) {
    lines_[index].bus.take_rom_writes(out);
  }
  Verdict verdict() const;
  /// Null if the robot has no body.
  const Mechanism* body() const { return coupling_ ? coupling_->body() : nullptr; }

 private:
  friend class ScenarioFleet;  // advances the motors of several runs
  struct Line {
    std::string interface;
    Bus bus;
    HostScript host;
    Judge judge;
    std::vector<Traffic> traffic;  // since time()
  };
  /// Returns false if the bus waits for shared motors (Bus::advance_to).
  bool advance(std::size_t index, SimTime until);
  void send(std::size_t index, const TimedFrame& query);
  std::vector<Bus*> buses();
  /// Advances a bus to `due`, at which the coupling exchanges (Coupling::next_due). Returns false
  /// if the bus has to wait for shared motors before.
  bool reach(std::size_t index, SimTime due);
  /// Pre: all buses have reached Coupling::next_due.
  void exchange();
  /// Pre: all buses have reached `until`. Merges their traffic.
  void merge_traffic(SimTime until);

  SimTime time_{0};
  std::vector<Line> lines_;
  std::optional<Coupling> coupling_;
  std::vector<Traffic> traffic_;     // not yet taken
  std::vector<TimedFrame> replies_;  // kept to reuse its memory
};

}  // namespace lk::emulator
