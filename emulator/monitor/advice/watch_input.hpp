#pragma once

/// @file Input of watchers: the state of a drive when last observed, and a decoded query to it.

#include <array>
#include <cstdint>
#include <optional>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/bus_config.hpp"
#include "emulator/monitor/advice/advice.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {

/// State of a drive at the last observation. After a frame for the drive it is up to 1 ms old,
/// otherwise up to n ms on a bus with n drives.
struct KnownDrive {
  KnownDrive(const ServoConfig& config, const BusConfig& bus);
  /// Pre: `bus` is settled.
  void observe(const Bus& bus);

  // Fixed properties.
  int id;
  protocol::WireFormat format;
  std::uint32_t circle_cdeg;         // upper limit of single-turn targets, exclusive
  std::uint32_t widest_circle_cdeg;  // the same limit for generations with 32-bit targets
  std::uint16_t max_offset_counts;
  double no_load_dps;       // of the rotor, at the configured supply
  SimTime shortest_answer;  // from a query's start to the last bit of its reply; 0: no bit rate
  SimTime byte_time;        // on RS-485; 0: CAN, or no bit rate
  bool receives_while_replying;  // on RS-485 (SerialConfig)
  SimTime adapter_worst;         // longest delay that the hosts' adapter adds; 0: no adapter
  std::uint32_t endurance;       // ROM writes that one parameter survives
  double gear_ratio;
  double rated_Nm;  // at the output; 0: not specified

  // State at the last observation.
  int address = 0;     // ID at which it answers
  bool on_bus = true;  // its settings of bus type and bit rate match the bus it is wired to
  bool alive = true;
  bool multi_drive = false;
  RunState run_state = RunState::kRunning;
  model::ErrorBits errors = 0;
  double angle_deg = 0;  // multi-turn
  double max_speed_dps = 0;
  double max_angle_deg = 0;                            // 0: none
  std::optional<SimTime> input_window = std::nullopt;  // time-out of the lost-input protection
  RomWear wear{};
  std::uint64_t refused_motion = 0;  // commands so far
  std::uint32_t starts = 1;          // so far
  bool calibrating = false;          // 0x18 is turning the shaft
  double torque_Nm = 0;              // of the motor, at the output
  UnaskedMotion unasked{};           // last one
  bool clear_reply_before = false;   // its reply to 0x9B shows the errors before clearing

  /// Returns true if the drive answers queries of its state. In multi-drive mode, only drives that
  /// know 0x288 do.
  bool can_be_asked() const;
  /// Upper limit of the rotor speed. `asked_dps`: limit in the frame; 0: none.
  double fastest_dps(double asked_dps) const;

 private:
  void look_at(const Registers& ram);
};

/// A motion command. Its `value` is in degrees or dps of the rotor, in A, or in per mille of power.
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
  const protocol::Payload& data;  // for a slot of 0x288: the command byte and zeros
  const protocol::Command& command;
  std::optional<MotionCommand> motion;
  std::optional<SimTime> gap;  // since the previous query to the drive

  template <class Wanted>
  bool is() const {
    return std::holds_alternative<Wanted>(command);
  }
};

/// Detects hosts that keep polling an ID without an answer, between queries to other IDs. The ID
/// may have no drive here.
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
    bool elsewhere = false;  // a reply came as a host's frame: another program runs this drive
  };
  std::array<Polled, protocol::kMaxId + 1> polled_{};
  int asked_last_ = 0;
};

/// Detects queries that are sent while the previous reply is still in the hosts' adapter.
class TimeoutWatch {
 public:
  static constexpr int kTimes = 10;

  std::optional<Finding> on_query(const DecodedQuery& query, const KnownDrive& drive);
  void on_reply();

 private:
  int waiting_ = 0;     // replies that have not come
  bool early_ = false;  // the last query came before the previous reply
  int times_ = 0;       // early queries whose previous reply then came
};

}  // namespace lk::emulator
