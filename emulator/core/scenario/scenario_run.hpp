#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/coupling/coupling.hpp"
#include "emulator/core/scenario/host_script.hpp"
#include "emulator/core/scenario/judge.hpp"
#include "emulator/core/scenario/scenario.hpp"

namespace lk::emulator {

enum class Outcome : std::uint8_t {
  kPassed,
  kFailed,   // something expected did not come about
  kInvalid,  // the run says nothing: what was planned never took effect, or it ended too early
};

/// A fault that was planned, and what came of it.
struct PlannedFault {
  std::string bus;  // interface
  FaultReport report;
  bool took_effect() const { return report.evidence.effects > 0; }
};

struct Verdict {
  Outcome outcome = Outcome::kPassed;
  std::vector<ExpectationResult> expectations;
  std::vector<PlannedFault> faults;
  std::vector<std::string> invalid;  // why it is, a sentence each
};

/// How a bus stood when a scenario began on it.
struct Beginning {
  SimTime start{0};
  std::size_t faults = 0;  // there were so many
  std::size_t unmet = 0;   // directives that waited for a condition
};

/// What is expected and planned of one bus, as far as it has come.
void add_to_verdict(const Judge& judge, const Bus& bus, const std::string& interface,
                    const Beginning& beginning, Verdict& verdict);
/// After all buses were added: the outcome.
void conclude(Verdict& verdict);

/// A frame on one of the buses.
struct Traffic {
  std::size_t bus = 0;
  TimedFrame frame;
  bool from_host = false;
};

/// A scenario on buses of its own, in simulated time. All buses advance together. A value: a copy
/// goes on from where the run stands.
class ScenarioRun {
 public:
  explicit ScenarioRun(const Scenario& scenario);

  SimTime time() const { return time_; }
  void advance_to(SimTime until);
  /// Besides what the scenario's own host says: a host puts `in.frame` on the bus `index` at
  /// `in.at`, or now where that is over. Brings the run there.
  void receive(std::size_t index, const TimedFrame& in);
  /// What happens to the bus `index` besides what its scenario has; all comes about as if it stood
  /// there, as the last event. Its time must not be over. Returns false, and plans nothing, when
  /// the bus has no room for another fault or another condition.
  bool plan(std::size_t index, const TimedDirective& event) {
    return lines_[index].bus.plan_as_configured(event);
  }
  std::size_t size() const { return lines_.size(); }
  const Bus& bus(std::size_t index) const { return lines_[index].bus; }
  /// Frames since the last call, in order of time; appended. A host's has the time at which the
  /// host handed it over, a drive's that of its last bit.
  void take_traffic(std::vector<Traffic>& out);
  /// What drives have written to their ROM since the last call.
  void take_rom_writes(std::size_t index, std::vector<RomWrite>& out) {
    lines_[index].bus.take_rom_writes(out);
  }
  Verdict verdict() const;
  /// Where its robot has one.
  const Mechanism* body() const { return coupling_ ? coupling_->body() : nullptr; }

 private:
  friend class ScenarioFleet;  // brings the motors of several runs
  struct Line {
    std::string interface;
    Bus bus;
    HostScript host;
    Judge judge;
    std::vector<Traffic> traffic;  // since the run stood at time()
  };
  /// Returns false where the bus has to wait for motors that it shares (Bus::advance_to).
  bool advance(std::size_t index, SimTime until);
  void put(std::size_t index, const TimedFrame& query);
  std::vector<Bus*> buses();
  /// To an instant at which the body wants its drives (Coupling::next_due), or as far as the bus
  /// gets.
  bool reach(std::size_t index, SimTime due);
  /// All buses have reached it.
  void exchange();
  /// All buses have got there.
  void arrive(SimTime until);

  SimTime time_{0};
  std::vector<Line> lines_;
  std::optional<Coupling> coupling_;
  std::vector<Traffic> traffic_;     // not yet taken
  std::vector<TimedFrame> replies_;  // kept for its memory
};

}  // namespace lk::emulator
