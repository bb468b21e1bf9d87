#pragma once

/// @file Input of watchers: a drive as last seen, and a frame for it.

#include <array>
#include <cstdint>
#include <optional>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/bus_config.hpp"
#include "emulator/monitor/advice/advice.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {

/// State of a drive, up to 1 ms old.
struct KnownDrive {
  KnownDrive(const ServoConfig& config, const BusConfig& bus);
  /// Pre: `bus` is settled.
  void observe(const Bus& bus);

  // Fixed properties.
  int id;
  protocol::WireFormat format;
  std::uint32_t circle_cdeg;         // upper limit of single-turn targets, exclusive
  std::uint32_t widest_circle_cdeg;  // that limit in a newer generation
  std::uint16_t max_offset_counts;
  double no_load_dps;            // of the rotor, at the configured supply
  SimTime shortest_answer;       // from a query's start to the last bit of its reply; 0: no wire
  SimTime byte_time;             // on RS-485; 0: no wire
  bool receives_while_replying;  // on RS-485 (SerialConfig)
  SimTime adapter_worst;         // longest delay that the hosts' adapter adds; 0: no adapter
  std::uint32_t endurance;       // writes of one parameter
  double gear_ratio;
  double rated_Nm;  // at the output; 0: not specified

  // State at the last observation.
  int address = 0;     // ID at which it answers
  bool on_bus = true;  // it receives the bus it is wired to, at that bit rate
  bool alive = true;
  bool multi_drive = false;
  RunState run_state = RunState::kRunning;
  model::ErrorBits errors = 0;
  double angle_deg = 0;  // multi-turn
  double max_speed_dps = 0;
  double max_angle_deg = 0;                            // 0: none
  std::optional<SimTime> input_window = std::nullopt;  // time-out of the lost-input protection
  RomWear wear{};
  std::uint64_t refused_motion = 0;
  std::uint32_t starts = 1;
  bool calibrating = false;         // 0x18 is turning the shaft
  double torque_Nm = 0;             // of the motor, at the output
  bool clear_reply_before = false;  // its reply to 0x9B shows the errors before clearing

  /// Returns true if the drive answers some query: in multi-drive mode, one for several drives.
  bool can_be_asked() const;
  /// Upper limit of the rotor speed. `asked_dps`: limit in the frame; 0: none.
  double fastest_dps(double asked_dps) const;

 private:
  void look_at(const Registers& ram);
};

/// A motion command, in degrees, dps, A or per mille of the rotor.
struct MotionCommand {
  protocol::Opcode opcode = protocol::Torque::kOpcode;
  double value = 0;
  double max_speed_dps = 0;  // limit in the frame; 0: none

  bool absolute() const {
    return opcode == protocol::Position1::kOpcode || opcode == protocol::Position2::kOpcode;
  }
  bool increment() const {
    return opcode == protocol::Position5::kOpcode || opcode == protocol::Position6::kOpcode;
  }
};
/// Returns nullopt if `command` moves nothing or has no slot for the drive.
std::optional<MotionCommand> motion_of(const protocol::Command& command, int id);

/// A frame that the drive has understood, or will understand when it arrives.
struct DecodedQuery {
  SimTime at;
  const protocol::Payload& data;  // for a byte of 0x288: a command and zeros
  const protocol::Command& command;
  std::optional<MotionCommand> motion;
  std::optional<SimTime> gap;  // since the last one for the drive

  template <class Wanted>
  bool is() const {
    return std::holds_alternative<Wanted>(command);
  }
};

/// Drives, present or not, that are polled without ever an answer, between queries to others.
class DeadWatch {
 public:
  static constexpr int kInARow = 20;
  static constexpr SimTime kLong = std::chrono::seconds(2);  // a host may notice by then (assumed)
  static constexpr SimTime kPause =
      std::chrono::milliseconds(500);  // a host that waits longer backs off (assumed)

  /// Processes a host's frame for the drive `id`.
  std::optional<Finding> on_query(const TimedFrame& in, int id);
  void on_reply(int id);

 private:
  struct Polled {
    SimTime since{0};
    SimTime last{0};
    int in_a_row = 0;
    bool elsewhere = false;  // it has replied here: a drive of another program
  };
  std::array<Polled, protocol::kMaxId + 1> polled_{};
  int asked_last_ = 0;
};

/// Queries sent while the previous reply is still in the hosts' adapter.
class TimeoutWatch {
 public:
  static constexpr int kTimes = 10;

  std::optional<Finding> on_query(const DecodedQuery& query, const KnownDrive& drive);
  void on_reply();

 private:
  int waiting_ = 0;     // replies
  bool early_ = false;  // the last query came before the previous reply
  int times_ = 0;       // and that reply came later
};

}  // namespace lk::emulator
