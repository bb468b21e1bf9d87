#pragma once

/// @file Firmware of a drive, between wire and motor: its state, and the functions that act on it.
/// The effects of the commands are in servo_states, servo_motion, servo_angles, servo_settings and
/// servo_serial.

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/bus_stats.hpp"
#include "emulator/core/servo/lane.hpp"
#include "emulator/core/servo/registers.hpp"
#include "emulator/core/servo/shaft_angles.hpp"
#include "emulator/core/servo/stored_settings.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {

using protocol::Query;
using protocol::Reply;

/// Event after which the next motion command is acknowledged but not executed.
enum class LostAfter : std::uint8_t { kBoot, kLostInput, kClear, kOff };

/// Injected lasting faults of firmware and memory.
struct FirmwareFaults {
  bool rom_write_fails = false;
  bool rom_worn = false;
  bool forgets_broadcast = false;
  bool forgets_limits = false;
  bool clear_reply_before = false;
  bool first_command_lost = false;
  LostAfter lost_after = LostAfter::kLostInput;
  bool hangs_after_off = false;
  OffHangs off_hangs = OffHangs::kNo;  // for hangs_after_off
  bool encoder_wrap_at_boot = false;
  int turns_at_boot = 0;  // error of the multi-turn angle at a start, rotor turns
  bool multi_turn_zero_at_boot = false;
};

enum class RunState : std::uint8_t { kOff, kStopped, kRunning };

/// A motion command as a set point of the loops.
struct Motion {
  model::Setpoint setpoint = model::Idle{};
  std::optional<CommandedPosition> position;       // of position commands
  std::optional<protocol::Position3> single_turn;  // request of 0xA5/0xA6
  // Requested values before a register limits them; the limits may change.
  std::optional<double> speed_dps;
  std::optional<std::int64_t> multi_turn_cdeg;
};

/// A calibration by 0x18.
struct Calibration {
  bool turned_back = false;
  std::int64_t from = 0;    // position at the start of this half
  std::int64_t travel = 0;  // counts in the halves before
};

/// State of a drive with an ID: registers, run state, angles, and the command in force. It does
/// not move the motor itself. A value.
struct Servo {
  /// `boot`: telemetry of the motor before its first tick.
  Servo(const ServoConfig& configuration, const model::Telemetry& boot);

  /// Configured ID, which may differ from the address.
  int id() const { return config.id; }
  int address() const { return bus_address.id; }
  /// The address in ROM differs from the one in force.
  bool address_changes_at_restart() const {
    return rom.driver_id != ram.driver_id || rom.bus_type != ram.bus_type ||
           rom.serial_rate != ram.serial_rate || rom.can_rate != ram.can_rate;
  }
  bool on_its_bus() const { return is_on_its_bus(bus_address, config); }
  bool at_its_rate() const { return is_at_its_rate(bus_address, config); }
  /// Identifier of its replies.
  std::uint32_t reply_id() const {
    return format.dialect.reply_id_base + static_cast<std::uint32_t>(address());
  }
  /// Answers multi-drive commands only.
  bool multi_drive_mode() const { return ram.broadcast_mode; }
  /// 0x18 turns the shaft, and its reply is pending.
  bool calibrating() const { return calibration.has_value(); }
  /// Executes and answers no command now: it calibrates, and calibrate_busy is kSilent.
  bool ignores_queries() const {
    return calibrating() && config.quirks.calibrate_busy == CalibrateBusy::kSilent;
  }
  /// It obeys commands, but sends nothing until it restarts.
  bool is_mute() const { return hung != OffHangs::kNo; }
  /// It holds the RS-485 line, so that other drives receive nothing either.
  bool holds_line() const { return hung == OffHangs::kBus; }
  /// The reply to 0x9B shows the errors before the command.
  bool clear_reply_before() const {
    return faults.clear_reply_before || config.quirks.clear_reply == ClearReply::kBefore;
  }

  // Values on the wire for this state of the motor.
  /// A tripped protection turns the bridge off at once, even without a query.
  RunState run_state_at(const model::Telemetry& telemetry) const {
    return telemetry.errors != 0 ? RunState::kOff : run_state;
  }
  double multi_turn_deg(const model::Telemetry& telemetry) const {
    return 0.01 * static_cast<double>(angles.multi_turn_cdeg(angles.position(telemetry)));
  }
  std::uint16_t encoder_counts(const model::Telemetry& telemetry) const {
    return angles.encoder(angles.position(telemetry), ram.encoder_offset);
  }

  ServoConfig config;
  protocol::WireFormat format;
  Registers rom;
  RomWear wear;
  Registers rom_before;  // contents of ROM before the last write
  RomWear wear_before{};
  Registers ram;
  Registers pending;  // parameters in pending_parameters wait here for 0x44
  std::bitset<kRomParameters> pending_parameters;
  std::bitset<kRomParameters> saved_parameters;  // last written by 0x44, with values of `pending`
  DriveAddress bus_address;                      // in force: ID, bus and bit rates
  bool address_change_pending = false;           // to the address in pending_rom(), after the reply
  ShaftAngles angles;
  RunState run_state = RunState::kRunning;
  bool tripped = false;        // a protection tripped; the drive has not run since
  Motion motion;               // in force, or kept by a stop
  bool brake_powered = false;  // commanded state of the coil; power releases the brake
  std::optional<Calibration> calibration;
  // D[3:6] of the last packet that had them; initial value assumed (docs/reference/rs485.md).
  std::int32_t left_in_buffer_cdeg = 0x0100'0000;
  std::uint32_t starts = 0;  // of the controller, power-up included
  bool restart_pending = false;
  OffHangs hung = OffHangs::kNo;
  bool loses_next = false;  // the next motion command is lost
  FirmwareFaults faults;
  FirmwareFaults effective_faults;  // that have had an effect since take_effective_faults()
  ServoStats stats;
};

/// Decodes a frame as a query in its single-drive form. Returns kForeignId or kUnknownCommand if
/// this drive does not answer it.
std::variant<Query, protocol::Reject> understand(const Servo& servo, const protocol::Frame& frame);
/// Executes a query from `understand` and returns the reply. Pre: the motor is at the time of the
/// query's last bit. The reply shows that state; the query affects the next one.
Reply handle(Servo& servo, const Query& query, const Lane& lane);
protocol::Frame encode(const Servo& servo, const Reply& reply);
/// Stores an RS-485 packet with this drive's ID, whose remains 0x95 may read.
void keep_received(Servo& servo, const protocol::Frame& packet);

/// Returns true if 0x07 was handled since the last call: the controller has to restart.
bool take_restart(Servo& servo);
/// Restarts the controller: ROM is kept; RAM, turn count, errors and command are lost.
void power_cycle(Servo& servo, const Lane& lane);

/// Ends the first half of 0x18. Returns true if the second half begins.
bool turn_back(Servo& servo, const Lane& lane);
/// Ends 0x18 and returns its reply. Pre: calibrating(). `random` selects the align value.
Reply finish_calibration(Servo& servo, const Lane& lane, std::uint64_t random);

/// ROM contents after 0x44 has saved the pending settings.
Registers pending_rom(const Servo& servo);
/// Applies an address change that takes effect without a restart, after the reply to the query.
/// Returns false if there is none.
bool take_address_change(Servo& servo);
/// Sets the ID at which it answers, in RAM and in ROM.
void change_id(Servo& servo, int id);
/// Writes the setting `parameter` of `value` at the drive, not over the wire, to RAM and ROM.
/// Pre: the registers can hold it.
void write_setting(Servo& servo, RomParameter parameter, const Registers& value, const Lane& lane);
/// Replaces the contents of ROM.
void restore_rom(Servo& servo, const Registers& rom, const RomWear& wear);

/// Returns the faults that have had an effect since the last call.
FirmwareFaults take_effective_faults(Servo& servo);
/// Sets a parameter in ROM to its factory value and counts a ROM write. Returns false if it has
/// that value already.
bool damage_rom(Servo& servo, RomParameter parameter);
/// Flips a bit of a setting in RAM; `random` chooses it. Returns false if the register allows no
/// other value.
bool flip_ram(Servo& servo, RomParameter parameter, std::uint64_t random, const Lane& lane);

}  // namespace lk::emulator
