#pragma once

/// @file What watchers are told: a drive as it was when it was last looked at, and a frame for it.

#include <cstdint>
#include <optional>

#include "emulator/core/bus/bus.hpp"
#include "emulator/core/bus_config.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {

inline double in_s(SimTime time) { return std::chrono::duration<double>(time).count(); }

/// A drive, up to 1 ms ago.
struct KnownDrive {
  KnownDrive(const ServoConfig& config, const BusConfig& bus);
  /// `bus` must be settled.
  void look(const Bus& bus);

  // What it is.
  int id;
  protocol::WireFormat format;
  std::uint32_t circle_cdeg;         // single-turn targets lie below
  std::uint32_t widest_circle_cdeg;  // the same with a newer generation
  std::uint16_t max_offset_counts;
  double no_load_dps;         // of the rotor, at the configured supply
  SimTime shortest_answer;    // from a query's start to the last bit of its reply; 0: no wire
  SimTime byte_time;          // on RS-485; 0: no wire
  bool hears_while_replying;  // on RS-485 (SerialConfig)
  SimTime adapter_worst;      // that the hosts' adapter adds to that, at most; 0: no adapter
  std::uint32_t endurance;    // writes of one parameter
  double gear_ratio;
  double rated_Nm;  // at the output; 0: not printed

  // How it was.
  int address = 0;     // the ID that it answers at
  bool on_bus = true;  // it hears the bus that it is wired to, at that rate
  bool alive = true;
  bool multi_drive = false;
  RunState run_state = RunState::kRunning;
  model::ErrorBits errors = 0;
  double angle_deg = 0;  // multi-turn
  double max_speed_dps = 0;
  double max_angle_deg = 0;                            // 0: none
  std::optional<SimTime> input_window = std::nullopt;  // after which lost input trips
  RomWear wear{};
  std::uint64_t refused_motion = 0;
  std::uint32_t starts = 1;
  bool calibrating = false;         // 0x18 turns the shaft
  double torque_Nm = 0;             // of the motor, at the output
  bool clear_reply_before = false;  // its reply to 0x9B shows the errors from before

  /// There is a query that it answers: in multi-drive mode only those for several are.
  bool can_be_asked() const;
  /// The rotor goes no faster, whatever is asked; `asked_dps` of a frame, 0: none.
  double fastest_dps(double asked_dps) const;

 private:
  void look_at(const Registers& ram);
};

/// What makes a drive move, in degrees, dps, A or per mille of the rotor.
struct MotionCommand {
  protocol::Opcode opcode = protocol::Torque::kOpcode;
  double value = 0;
  double max_speed_dps = 0;  // of the frame; 0: none

  bool absolute() const {
    return opcode == protocol::Position1::kOpcode || opcode == protocol::Position2::kOpcode;
  }
  bool increment() const {
    return opcode == protocol::Position5::kOpcode || opcode == protocol::Position6::kOpcode;
  }
};
/// None: `command` moves nothing; or there is no slot for the drive in it.
std::optional<MotionCommand> motion_of(const protocol::Command& command, int id);

/// A frame that a drive has understood, or will when it gets there.
struct Heard {
  SimTime at;
  const protocol::Payload& data;  // a byte of 0x288 is a command with a payload of zeros
  const protocol::Command& command;
  std::optional<MotionCommand> motion;

  template <class Wanted>
  bool is() const {
    return std::holds_alternative<Wanted>(command);
  }
};

}  // namespace lk::emulator
