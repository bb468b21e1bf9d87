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

/// Result of an expectation.
struct ExpectationResult {
  enum class Status : std::uint8_t { kPassed, kFailed, kOpen };
  Status status = Status::kOpen;
  std::string expected;               // "vcan0 drive 1: speed_dps 90 to 110 at 2 s"
  std::string measured;               // "101.3", "0 at 1.25 s", "3 replies, the first at 0.5 s"
  std::string description;            // text from the scenario
  std::optional<SimTime> at;          // time of the deciding event, since the scenario began
  std::optional<SimTime> decided_at;  // since the scenario began; absent while it is open
  // Distance from failing; absent if undefined. For a signal: least distance from the nearest
  // bound, below 0 if failed. It is divided by the width of the range, by |bound| if there is one
  // bound, by 1 if this divisor is 0. For a passed kBy: share of its period that remained.
  std::optional<double> margin;
};
/// "passed", "failed" or "open".
const char* status_word(ExpectationResult::Status status);

/// Judges the expectations for one bus. The owner of the bus stops it at `next_due`, calls `sample`
/// there, and passes on all frames in order of time.
class Judge {
 public:
  /// Sampling period for expectations of kind kBy and kThroughout.
  static constexpr SimTime kStep = std::chrono::milliseconds(1);

  /// Copies the expectations for the bus `bus` of the robot; their times count from `start`.
  Judge(const BusConfig& config, const std::vector<Expectation>& expectations, std::size_t bus,
        SimTime start);

  /// Time of the next sample; SimTime::max() if no sample is left.
  SimTime next_due() const { return next_due_; }
  void sample(const Bus& bus);
  /// Call when a host sends this query to the drives of `bus`. Drives in multi-drive mode listen
  /// only to multi-drive identifiers (e.g. 0x280), the others only to their own identifier.
  void on_query(const TimedFrame& query, const Bus& bus);
  /// Call for each frame that hosts have received.
  void on_reply(const TimedFrame& reply);

  /// Results at the instant `now`, in the order of the scenario.
  std::vector<ExpectationResult> results(SimTime now) const;

 private:
  struct Trial {
    Expectation expectation;
    SimTime next = SimTime::max();  // next sample
    ExpectationResult::Status status = ExpectationResult::Status::kOpen;
    std::optional<double> value;  // deciding sample, or the closest so far
    std::optional<Range> seen;    // range of a signal so far
    SimTime at{0};                // time of `value`, or of the first reply
    std::uint64_t count = 0;      // number of matching replies
    std::optional<SimTime> decided_at;
    // For Answered: time of the oldest unanswered query of each command.
    std::map<std::uint8_t, SimTime> asked;
    std::optional<SimTime> missed;  // earliest deadline without an answer
  };
  /// A drive that sends replies, and its wire format.
  struct ReplyingDrive {
    int id = 1;
    std::uint32_t reply_id = 0;
    protocol::WireFormat format;
    std::array<std::optional<SimTime>, 256> asked{};  // time of the latest query, by DATA[0]
    int asked_as = 0;                                 // address of the drive at the latest query
  };

  void sample_trial(Trial& trial, const DriveView& drive, SimTime now);
  void on_answer(Trial& trial, const TimedFrame& reply) const;
  /// Returns the earliest missed deadline so far.
  static std::optional<SimTime> missed_by(const Trial& trial, SimTime now);
  bool matches(const Replies& replies, const ReplyingDrive& drive, const TimedFrame& reply) const;
  ExpectationResult result(const Trial& trial, SimTime now) const;
  std::string measured(const Trial& trial) const;
  static std::optional<double> margin(const Trial& trial);

  std::string interface_;
  SimTime start_;
  SimTime next_due_ = SimTime::max();
  std::vector<Trial> trials_;
  std::vector<ReplyingDrive> drives_;
};

/// First time at which an error bit of a drive was set.
struct FirstError {
  int id = 1;
  model::Error error = model::Error::kUnderVoltage;
  SimTime at{0};  // since the start
  friend bool operator==(const FirstError&, const FirstError&) = default;
};

/// Samples the error bits of all drives of a bus, every Judge::kStep.
class ErrorWatch {
 public:
  ErrorWatch(const BusConfig& config, SimTime start);

  SimTime next_due() const { return next_due_; }
  void sample(const Bus& bus);
  /// First errors in the order of time; at equal times by drive, then by bit.
  const std::vector<FirstError>& firsts() const { return firsts_; }

 private:
  struct Watched {
    int id = 1;
    model::ErrorBits seen{};
  };
  SimTime start_;
  SimTime next_due_;
  std::vector<Watched> drives_;
  std::vector<FirstError> firsts_;
};

}  // namespace lk::emulator
