#pragma once

/// @file A scenario as plain values (docs/scenarios.md): a robot, what happens to it, what a host
/// says, and what is expected to come of it.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/servo/servo.hpp"
#include "emulator/core/servo/signals.hpp"

namespace lk::emulator {

/// A frame that a host sends, once or at equal steps.
struct HostSend {
  std::size_t bus = 0;  // its place in the robot
  SimTime at{0};
  protocol::Frame frame;
  SimTime every{0};         // above 0 when `times` is above 1
  std::uint64_t times = 1;  // in all
};

/// Bounds are part of the range.
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
  std::optional<model::Error> one;  // nothing: any
  bool in(model::ErrorBits errors) const { return (one ? errors & model::bit(*one) : errors) != 0; }
};
struct ErrorIs {
  WhichError error;
  bool set = true;
};
struct StateIs {
  RunState state = RunState::kRunning;
};
/// So many replies of the drive, or of whoever uses its identifier, are as described.
struct Replies {
  std::optional<std::uint8_t> command;  // DATA[0]
  std::optional<WhichError> error;      // the bit is set in what it says
  std::string_view field;    // a quantity of the reply, protocol::reply_words(); empty: any
  Range range;               // of the field
  std::optional<Range> age;  // ms since the latest query with this command to this drive
  std::uint64_t min_count = 1;
  std::uint64_t max_count = std::numeric_limits<std::uint64_t>::max();
};

/// The drive answers what it is asked, as a host sees it: each query, or each of one command.
struct Answered {
  std::optional<std::uint8_t> command;  // DATA[0]
  SimTime within{0};                    // of the instant at which the host sent it
};

/// When something is expected. Replies are counted from `from` to `to`, whatever the kind.
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
  std::string says;  // a sentence for the report; may be empty
};

/// A drive of the robot that a scenario was written for, where what runs is another one.
struct ForeignDrive {
  std::string bus;
  int id = 1;
  std::string meant;    // its motor
  std::string running;  // the motor with that ID here; empty: there is none
  friend bool operator==(const ForeignDrive&, const ForeignDrive&) = default;
};

struct Scenario {
  std::string name;
  std::string about;
  std::string robot_name;             // as the file has it; may be empty on buses that run already
  std::vector<ForeignDrive> foreign;  // on buses that run already, as far as its robot can be read
  std::vector<BusConfig> robot;       // with all events
  SimTime duration{0};
  std::vector<HostSend> sends;
  std::vector<Expectation> expectations;
};

}  // namespace lk::emulator
