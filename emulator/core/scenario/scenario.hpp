#pragma once

/// @file A scenario as plain values (docs/guides/scenarios.md): robot, events, frames of a host,
/// and expectations.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/servo/servo.hpp"
#include "emulator/core/servo/signals.hpp"

namespace lk::emulator {

/// A frame that a host sends, once or periodically.
struct HostSend {
  std::size_t bus = 0;  // index in the robot
  SimTime at{0};
  protocol::Frame frame;
  SimTime every{0};         // period; above 0 if `times` is above 1
  std::uint64_t times = 1;  // in total
};

/// Range with inclusive bounds.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool has(double value) const { return value >= min && value <= max; }
};

struct SignalWithin {
  const Signal* signal = nullptr;
  Range range;
};
/// An error bit, or any of them.
struct WhichError {
  WhichError() = default;
  WhichError(model::Error error) : one(error) {}
  std::optional<model::Error> one;  // nullopt: any
  bool in(model::ErrorBits errors) const { return (one ? errors & model::bit(*one) : errors) != 0; }
};
struct ErrorIs {
  WhichError error;
  bool set = true;
};
struct StateIs {
  RunState state = RunState::kRunning;
};
/// Number of matching replies from the drive, or from other drives with the drive's identifier.
struct Replies {
  std::optional<std::uint8_t> command = {};  // DATA[0]
  std::optional<WhichError> error = {};      // the bit is set in the reply
  std::string_view field = {};    // quantity of the reply, protocol::reply_words(); empty: any
  Range range = {};               // of the field
  std::optional<Range> age = {};  // ms since the latest query with this command to this drive
  std::uint64_t min_count = 1;
  std::uint64_t max_count = std::numeric_limits<std::uint64_t>::max();
};

/// The drive answers every query, or every query with `command`, with a reply that a host accepts.
struct Answered {
  std::optional<std::uint8_t> command;  // DATA[0]
  SimTime within{0};                    // after the host has sent the query
};

/// Time of an expectation. Replies are counted from `from` to `to`, for every kind.
struct Period {
  enum class Kind : std::uint8_t {
    kAt,          // at `to`
    kBy,          // at some instant from `from` to `to`
    kThroughout,  // all the time from `from` to `to`
  };
  Kind kind = Kind::kAt;
  SimTime from{0};
  SimTime to{0};
};

struct Expectation {
  std::size_t bus = 0;
  int id = 1;
  std::variant<SignalWithin, ErrorIs, StateIs, Replies, Answered> what;
  Period when;
  std::string description;  // a sentence for the report; may be empty
};

/// Mismatch between a drive of the scenario's robot and the robot that runs.
struct DriveMismatch {
  std::string bus;
  int id = 1;
  std::string meant;    // motor in the scenario
  std::string running;  // motor with that ID in the robot that runs; empty: no such drive
  friend bool operator==(const DriveMismatch&, const DriveMismatch&) = default;
};

struct Scenario {
  std::string name;
  std::string about;
  std::string robot_name;                 // as in the file; may be empty for running buses
  std::vector<DriveMismatch> mismatches;  // for running buses, if the scenario's robot is readable
  std::vector<BusConfig> robot;           // including all events of the scenario
  SimTime duration{0};
  std::vector<HostSend> sends;
  std::vector<Expectation> expectations;
};

/// Frames of a host on one bus, by time; at equal times in the order of the list.
class HostScript {
 public:
  /// Copies the frames for the bus `bus` from `sends`; their times count from `start`.
  HostScript(const std::vector<HostSend>& sends, std::size_t bus, SimTime start) {
    for (const HostSend& send : sends) {
      if (send.bus != bus || send.times == 0) continue;
      heap_.push_back({send.at + start, heap_.size(), send});
    }
    std::ranges::make_heap(heap_, later);
  }

  /// Time of the next frame; SimTime::max() if none is left.
  SimTime next_due() const { return heap_.empty() ? SimTime::max() : heap_.front().at; }
  /// Pre: a frame is left. Removes and returns the next one.
  TimedFrame take() {
    std::ranges::pop_heap(heap_, later);
    Next& next = heap_.back();
    const TimedFrame frame{next.at, next.send.frame};
    if (--next.send.times > 0) {
      next.at += next.send.every;
      std::ranges::push_heap(heap_, later);
    } else {
      heap_.pop_back();
    }
    return frame;
  }

 private:
  struct Next {
    SimTime at;
    std::size_t place;
    HostSend send;
  };
  static bool later(const Next& a, const Next& b) {
    return std::pair(a.at, a.place) > std::pair(b.at, b.place);
  }

  std::vector<Next> heap_;
};

}  // namespace lk::emulator
