#pragma once

/// @file Firmware of a drive, between wire and motor: the state, and functions that act on the
/// state. The commands are implemented in servo_states, servo_motion, servo_angles, servo_settings
/// and servo_serial.

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
  // Requested values, before the limits in registers; kept because the limits may change.
  std::optional<double> speed_dps;
  std::optional<std::int64_t> multi_turn_cdeg;
};

/// A calibration by 0x18.
struct Calibration {
  bool turned_back = false;
  std::int64_t from = 0;    // position at the start of the current half, counts
  std::int64_t travel = 0;  // distance in the finished half, counts
};

/// Firmware state of a drive: registers, run state, angles, and the command in force. The motor is
/// separate: functions that command it take a Lane. Copies are independent.
struct Servo {
  /// `boot`: telemetry of the motor before its first tick.
  Servo(const ServoConfig& configuration, const model::Telemetry& boot);

  /// Configured ID, which may differ from the address.
  int id() const { return config.id; }
  int address() const { return bus_address.id; }
  /// ROM has another address than RAM, so a restart changes the drive's address.
  bool address_changes_at_restart() const {
    return rom.driver_id != ram.driver_id || rom.bus_type != ram.bus_type ||
           rom.serial_rate != ram.serial_rate || rom.can_rate != ram.can_rate;
  }
  bool on_its_bus() const { return is_on_its_bus(bus_address, config); }
  bool at_its_rate() const { return is_at_its_rate(bus_address, config); }
  /// CAN identifier of the drive's replies.
  std::uint32_t reply_id() const {
    return format.dialect.reply_id_base + static_cast<std::uint32_t>(address());
  }
  /// The drive answers multi-drive commands only.
  bool multi_drive_mode() const { return ram.broadcast_mode; }
  /// A calibration (0x18) turns the shaft; the reply to 0x18 is pending.
  bool calibrating() const { return calibration.has_value(); }
  /// The drive ignores all commands now: it calibrates, and calibrate_busy is kSilent.
  bool ignores_queries() const {
    return calibrating() && config.quirks.calibrate_busy == CalibrateBusy::kSilent;
  }
  /// The drive executes commands, but sends nothing until it restarts.
  bool is_mute() const { return hung != OffHangs::kNo; }
  /// The drive holds the RS-485 line, so no drive receives anything.
  bool holds_line() const { return hung == OffHangs::kBus; }
  /// The reply to 0x9B shows the errors before the command.
  bool clear_reply_before() const {
    return faults.clear_reply_before || config.quirks.clear_reply == ClearReply::kBefore;
  }

  // Values that the drive reports if the motor is in the state `telemetry`.
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
  Registers pending;  // values that 0x44 will save, for the parameters in pending_parameters
  std::bitset<kRomParameters> pending_parameters;
  std::bitset<kRomParameters> saved_parameters;  // saved by the last 0x44, values in `pending`
  DriveAddress bus_address;                      // in force: ID, bus and bit rates
  bool address_change_pending = false;           // pending_rom() holds the address after the reply
  ShaftAngles angles;
  RunState run_state = RunState::kRunning;
  bool tripped = false;        // a protection tripped, and no 0x88 has restarted the motor since
  Motion motion;               // motion command in force, or kept during a stop
  bool brake_powered = false;  // commanded state of the coil; power releases the brake
  std::optional<Calibration> calibration;
  // D[3:6] of the last packet that was long enough: the angle that a 0x95 without payload sets.
  // Initial value assumed (docs/reference/rs485.md).
  std::int32_t left_in_buffer_cdeg = 0x0100'0000;
  std::uint32_t starts = 0;  // number of controller starts, power-up included
  bool restart_pending = false;
  OffHangs hung = OffHangs::kNo;
  bool loses_next = false;  // the next motion command is lost
  FirmwareFaults faults;
  FirmwareFaults effective_faults;  // that have had an effect since take_effective_faults()
  ServoStats stats;
};

/// Decodes a frame; a multi-drive query becomes the single-drive query for this drive. Returns the
/// reason if this drive does not answer it, e.g. kForeignId or kUnknownCommand.
std::variant<Query, protocol::Reject> understand(const Servo& servo, const protocol::Frame& frame);
/// Executes a query from `understand` and returns the reply. Pre: the motor is at the time of the
/// query's last bit. Measured values in the reply are from that time, before the query has effect.
Reply handle(Servo& servo, const Query& query, const Lane& lane);
protocol::Frame encode(const Servo& servo, const Reply& reply);
/// Call for each RS-485 packet with this drive's ID: updates `left_in_buffer_cdeg`.
void keep_received(Servo& servo, const protocol::Frame& packet);

/// Returns true if a 0x07 was handled since the last call: the caller must restart the controller.
bool take_restart(Servo& servo);
/// Restarts the controller: keeps ROM; loses RAM, turn count, errors and the command in force.
void power_cycle(Servo& servo, const Lane& lane);

/// Ends the first half of 0x18. Returns true if the second half begins.
bool turn_back(Servo& servo, const Lane& lane);
/// Ends 0x18 and returns its reply. Pre: calibrating(). `random` selects the align value.
Reply finish_calibration(Servo& servo, const Lane& lane, std::uint64_t random);

/// Returns the ROM contents that 0x44 would write: ROM with the pending settings.
Registers pending_rom(const Servo& servo);
/// Call after the reply to a query. Applies a pending address change that takes effect without a
/// restart. Returns false if there is none.
bool take_address_change(Servo& servo);
/// Sets the ID at which the drive answers, in RAM and in ROM.
void change_id(Servo& servo, int id);
/// Writes the setting `parameter` of `value` at the drive, not over the wire, to RAM and ROM.
/// Pre: the value is in the range of the register.
void write_setting(Servo& servo, RomParameter parameter, const Registers& value, const Lane& lane);
/// Replaces the contents of ROM.
void restore_rom(Servo& servo, const Registers& rom, const RomWear& wear);

/// Returns the faults that have had an effect since the last call.
FirmwareFaults take_effective_faults(Servo& servo);
/// Sets a parameter in ROM to its factory value and counts a ROM write. Returns false without
/// effect if the parameter has that value already.
bool damage_rom(Servo& servo, RomParameter parameter);
/// Flips a bit of a setting in RAM; `random` selects the bit. Returns false if no flipped value is
/// in the range of the register.
bool flip_ram(Servo& servo, RomParameter parameter, std::uint64_t random, const Lane& lane);

}  // namespace lk::emulator
