#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/scenario/scenario.hpp"

namespace lk::emulator {

/// What came of an expectation.
struct ExpectationResult {
  enum class Status : std::uint8_t { kPassed, kFailed, kOpen };
  Status status = Status::kOpen;
  std::string expected;               // "vcan0 drive 1: speed_dps 90 to 110 at 2 s"
  std::string measured;               // "101.3", "0 at 1.25 s", "3 replies, the first at 0.5 s"
  std::string says;                   // as the scenario has it
  std::optional<SimTime> at;          // of what decided, since the scenario began
  std::optional<SimTime> decided_at;  // since the scenario began; none while it is open
  // How far it stood from failing. Of a signal: the distance from the nearest bound, in widths of
  // its range (of a range with one bound, in multiples of that; of the bound 0, in units of the
  // signal), the least of all instants that count; below 0 it failed. Of what came about in time:
  // the part of its time that was left. None of what has no measure.
  std::optional<double> margin;
};

/// Watches one bus and keeps account of what is expected of it. Whoever advances the bus stops at
/// `next_due`, calls `look` there, and tells what is said on the wire in order of time.
class Judge {
 public:
  /// How often it looks at what is expected by or throughout a time.
  static constexpr SimTime kStep = std::chrono::milliseconds(1);

  /// Those of `expectations` that are for the bus `bus` of the robot; times count from `start`.
  Judge(const BusConfig& config, const std::vector<Expectation>& expectations, std::size_t bus,
        SimTime start);

  /// SimTime::max() when there is nothing to look at any more.
  SimTime next_due() const { return next_due_; }
  void look(const Bus& bus);
  /// A host has sent this to the drives of `bus`. It asks those that listen to it: a drive in
  /// multi-drive mode to 0x280 and its like only, any other to its own identifier only.
  void hear_query(const TimedFrame& query, const Bus& bus);
  /// This has left a drive.
  void hear_reply(const TimedFrame& reply);

  /// So far, at the instant `now`, in the order of the scenario.
  std::vector<ExpectationResult> results(SimTime now) const;

 private:
  struct Trial {
    Expectation expectation;
    SimTime next = SimTime::max();  // to look at
    ExpectationResult::Status status = ExpectationResult::Status::kOpen;
    std::optional<double> value;  // that decided, or came closest
    std::optional<Range> seen;    // of a signal
    SimTime at{0};                // of `value`; of the first reply
    std::uint64_t count = 0;      // replies
    std::optional<SimTime> decided_at;
    // Of Answered: the first query of a command that waits for its reply.
    std::map<std::uint8_t, SimTime> asked;
    std::optional<SimTime> missed;  // the first that was not answered by then
  };
  /// Whose replies are on the wire, and how to read them.
  struct Speaker {
    int id = 1;
    std::uint32_t reply_id = 0;
    protocol::WireFormat format;
    std::array<std::optional<SimTime>, 256> asked{};  // latest query, by DATA[0]
    int asked_as = 0;                                 // the ID that the latest query was for
  };

  void look_at(Trial& trial, const DriveView& drive, SimTime now);
  void hear_answer(Trial& trial, const TimedFrame& reply) const;
  /// The instant at which the first query had waited too long, so far.
  static std::optional<SimTime> missed_by(const Trial& trial, SimTime now);
  bool matches(const Replies& replies, const Speaker& speaker, const TimedFrame& reply) const;
  ExpectationResult result(const Trial& trial, SimTime now) const;
  std::string measured(const Trial& trial) const;
  static std::optional<double> margin(const Trial& trial);

  std::string interface_;
  SimTime start_;
  SimTime next_due_ = SimTime::max();
  std::vector<Trial> trials_;
  std::vector<Speaker> speakers_;
};

}  // namespace lk::emulator
