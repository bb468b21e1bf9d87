#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <variant>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/bus_stats.hpp"
#include "emulator/core/servo/lane.hpp"
#include "emulator/core/servo/registers.hpp"
#include "emulator/core/servo/shaft_angles.hpp"
#include "emulator/core/servo/stored_settings.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {

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

/// Firmware of a drive with an ID, between wire and motor: registers, run state, angles, and the
/// effect of each command. It does not move the motor itself. A value.
class Servo {
 public:
  /// `boot`: telemetry of the motor before its first tick.
  Servo(const ServoConfig& config, const model::Telemetry& boot);

  /// Configured ID, which may differ from the address.
  int id() const { return config_.id; }
  /// Address in force: ID, bus and bit rates.
  const DriveAddress& bus_address() const { return bus_address_; }
  /// The address in ROM differs from the one in force.
  bool address_changes_at_restart() const {
    return rom_.driver_id != ram_.driver_id || rom_.bus_type != ram_.bus_type ||
           rom_.serial_rate != ram_.serial_rate || rom_.can_rate != ram_.can_rate;
  }
  int address() const { return bus_address_.id; }
  bool on_its_bus() const { return is_on_its_bus(bus_address_, config_); }
  bool at_its_rate() const { return is_at_its_rate(bus_address_, config_); }
  /// ROM contents after 0x44 has saved the pending settings.
  Registers pending() const;
  /// Value that 0x40 returns for this setting.
  protocol::StoredSetting shown_setting(const protocol::StoredSetting& which) const;
  /// Some settings wait for 0x44.
  bool has_pending() const { return pending_parameters_.any(); }
  const ServoConfig& config() const { return config_; }
  SimTime reply_time() const { return config_.reply_time; }
  /// Answers multi-drive commands only.
  bool multi_drive_mode() const { return ram_.broadcast_mode; }
  /// Wire format of the drive.
  const protocol::WireFormat& format() const { return format_; }
  const Registers& ram() const { return ram_; }
  const Registers& rom() const { return rom_; }
  const RomWear& wear() const { return wear_; }
  // Contents of ROM before the last write.
  const Registers& rom_before() const { return rom_before_; }
  const RomWear& wear_before() const { return wear_before_; }
  const ServoStats& stats() const { return stats_; }
  // Values on the wire for this state of the motor.
  /// A tripped protection turns the bridge off at once, even without a query.
  RunState run_state(const model::Telemetry& telemetry) const {
    return telemetry.errors != 0 ? RunState::kOff : run_state_;
  }
  double multi_turn_deg(const model::Telemetry& telemetry) const {
    return 0.01 * static_cast<double>(angles_.multi_turn_cdeg(angles_.position(telemetry)));
  }
  std::uint16_t encoder_counts(const model::Telemetry& telemetry) const {
    return angles_.encoder(angles_.position(telemetry), ram_.encoder_offset);
  }
  /// Multi-turn angle of a position of the loops (model::Position).
  double multi_turn_deg_of(double theta) const { return angles_.multi_turn_deg(theta); }

  /// Decodes a frame as a query in its single-drive form. Returns kForeignId or kUnknownCommand if
  /// this drive does not answer it.
  std::variant<protocol::Query, protocol::Reject> understand(const protocol::Frame& frame) const;
  /// Executes a query from `understand` and returns the reply. Pre: the motor is at the time of the
  /// query's last bit. The reply shows that state; the query affects the next one.
  protocol::Reply handle(const protocol::Query& query, const Lane& lane);
  /// Identifier of its replies.
  std::uint32_t reply_id() const {
    return format_.dialect.reply_id_base + static_cast<std::uint32_t>(address());
  }
  protocol::Frame encode(const protocol::Reply& reply) const {
    return protocol::encode_reply(address(), reply, format_);
  }
  /// Returns true if 0x07 was handled since the last call: the controller has to restart.
  bool take_restart() { return std::exchange(restarts_, false); }
  /// Applies an address change that takes effect without a restart, after the reply to the query.
  /// Returns false if there is none.
  bool take_address_change();
  /// 0x18 turns the shaft, and its reply is pending.
  bool calibrating() const { return calibration_.has_value(); }
  /// Executes and answers no command now: it calibrates, and calibrate_busy is kSilent.
  bool ignores_queries() const {
    return calibrating() && config_.quirks.calibrate_busy == CalibrateBusy::kSilent;
  }
  /// Ends the first half of 0x18. Returns true if the second half begins.
  bool turn_back(const Lane& lane);
  /// Ends 0x18 and returns its reply. Pre: calibrating(). `random` selects the align value.
  protocol::Reply finish_calibration(const Lane& lane, std::uint64_t random);
  /// Sets the ID at which it answers, in RAM and in ROM.
  void change_id(int id);
  /// Stores an RS-485 packet with this drive's ID, whose remains 0x95 may read.
  void keep_received(const protocol::Frame& packet);
  /// The reply to 0x9B shows the errors before the command.
  bool clear_reply_before() const {
    return faults_.clear_reply_before || config_.quirks.clear_reply == ClearReply::kBefore;
  }
  /// Number of starts of the controller, power-up included.
  std::uint32_t starts() const { return starts_; }
  /// It obeys commands, but sends nothing until it restarts.
  bool is_mute() const { return hung_ != OffHangs::kNo; }
  /// It holds the RS-485 line, so that other drives receive nothing either.
  bool holds_line() const { return hung_ == OffHangs::kBus; }
  /// Records that holding the line affected a frame for other drives.
  void record_line_hold() { shown_faults_.hangs_after_off |= faults_.hangs_after_off; }
  /// Counters: a frame with an unknown command byte; a single-drive frame in multi-drive mode.
  void count_unknown_command() { ++stats_.unknown_commands; }
  void count_wrong_mode() { ++stats_.wrong_mode; }

  /// Writes the setting `parameter` of `value` at the drive, not over the wire, to RAM and ROM.
  /// Pre: the registers can hold it.
  void write_setting(RomParameter parameter, const Registers& value, const Lane& lane);
  /// Replaces the contents of ROM.
  void restore_rom(const Registers& rom, const RomWear& wear);

  /// Sets the active faults of firmware and memory.
  void set_faults(const FirmwareFaults& faults) { faults_ = faults; }
  /// Returns the faults that have had an effect since the last call.
  FirmwareFaults take_effective_faults() { return std::exchange(shown_faults_, {}); }
  /// Sets a parameter in ROM to its factory value and counts a ROM write. Returns false if it has
  /// that value already.
  bool damage_rom(RomParameter parameter);
  /// Flips a bit of a setting in RAM; `random` chooses it. Returns false if the register allows no
  /// other value.
  bool flip_ram(RomParameter parameter, std::uint64_t random, const Lane& lane);

  /// Restarts the controller: ROM is kept; RAM, turn count, errors and command are lost.
  void power_cycle(const Lane& lane);

 private:
  struct Context {
    const protocol::Query& query;
    const model::Telemetry& before;
    const Lane& lane;
  };
  /// A motion command as a set point of the loops.
  struct Motion {
    model::Setpoint setpoint = model::Idle{};
    std::optional<CommandedPosition> position;       // of position commands
    std::optional<protocol::Position3> single_turn;  // request of 0xA5/0xA6
    // Requested values before a register limits them; the limits may change.
    std::optional<double> speed_dps;
    std::optional<std::int64_t> multi_turn_cdeg;
  };

  static protocol::Echo echo(const Context& context) {
    return {context.query.data, context.query.size};
  }
  protocol::Reply on(const protocol::WriteZeroToRom&, const Context& context);
  protocol::Reply on(const protocol::ReadPid&, const Context& context) const;
  protocol::Reply on(const protocol::WritePidToRam& command, const Context& context);
  protocol::Reply on(const protocol::WritePidToRom& command, const Context& context);
  protocol::Reply on(const protocol::ReadAcceleration&, const Context& context) const;
  protocol::Reply on(const protocol::WriteAccelerationToRam& command, const Context& context);
  // Settings, restart and calibration: servo_settings.cpp.
  protocol::Reply on(const protocol::Restart&, const Context& context);
  protocol::Reply on(const protocol::Calibrate&, const Context& context);
  protocol::Reply on(const protocol::ReadMaxTorque&, const Context& context) const;
  protocol::Reply on(const protocol::WriteMaxTorque& command, const Context& context);
  protocol::Reply on(const protocol::ReadStoredSetting& command, const Context& context) const;
  protocol::Reply on(const protocol::WriteStoredSetting& command, const Context& context);
  protocol::Reply on(const protocol::SaveSettings& command, const Context& context);
  /// Lets the address in `pending()` take effect after the reply.
  void schedule_address_change();
  double lead_speed() const;
  protocol::Reply on(const protocol::Off&, const Context& context);
  protocol::Reply on(const protocol::Stop&, const Context& context);
  protocol::Reply on(const protocol::Run&, const Context& context);
  protocol::Reply on(const protocol::Brake& command, const Context& context);
  protocol::Reply on(const protocol::ReadEncoder& command, const Context& context) const;
  protocol::Reply on(const protocol::WriteOffsetToRom& command, const Context& context);
  protocol::Reply on(const protocol::ReadMultiTurnAngle&, const Context& context) const;
  protocol::Reply on(const protocol::ReadSingleTurnAngle&, const Context& context) const;
  protocol::Reply on(const protocol::ClearAngle& command, const Context& context);
  protocol::Reply on(const protocol::ReadState1&, const Context& context) const;
  protocol::Reply on(const protocol::ClearErrors&, const Context& context);
  protocol::Reply on(const protocol::ReadState2&, const Context& context) const;
  protocol::Reply on(const protocol::ReadState3&, const Context& context) const;
  protocol::Reply on(const protocol::OpenLoop& command, const Context& context);
  protocol::Reply on(const protocol::Torque& command, const Context& context);
  protocol::Reply on(const protocol::Speed& command, const Context& context);
  protocol::Reply on(const protocol::Position1& command, const Context& context);
  protocol::Reply on(const protocol::Position2& command, const Context& context);
  protocol::Reply on(const protocol::Position3& command, const Context& context);
  protocol::Reply on(const protocol::Position4& command, const Context& context);
  protocol::Reply on(const protocol::Position5& command, const Context& context);
  protocol::Reply on(const protocol::Position6& command, const Context& context);
  protocol::Reply on(const protocol::ReadParameter& command, const Context& context) const;
  protocol::Reply on(const protocol::WriteParameter& command, const Context& context);
  protocol::Reply on(const protocol::MultiTorque& command, const Context& context);
  protocol::Reply on(const protocol::MultiSpeed& command, const Context& context);
  protocol::Reply on(const protocol::MultiPosition& command, const Context& context);
  protocol::Reply on(const protocol::MultiCommand& command, const Context& context);
  // On RS-485 only: servo_serial.cpp.
  protocol::Reply on(const protocol::ReadSetting& command, const Context& context) const;
  protocol::Reply on(const protocol::WriteSettingToRam& command, const Context& context);
  protocol::Reply on(const protocol::WriteSettingToRom& command, const Context& context);
  protocol::Reply on(const protocol::ClearTurns&, const Context& context);
  protocol::Reply on(const protocol::Restore&, const Context& context) const;
  protocol::Reply on(const protocol::Connect&, const Context& context) const;
  protocol::Reply on(const protocol::Disconnect&, const Context& context) const;
  protocol::Reply on(const protocol::ReadProduct&, const Context& context) const;
  protocol::Reply on(const protocol::ReadDeviceType&, const Context& context) const;
  protocol::Reply on(const protocol::ReadSettingsBlock&, const Context& context) const;
  protocol::Reply on(const protocol::WriteSettingsBlock&, const Context& context);
  protocol::Reply on(const protocol::ReadCalibration&, const Context& context) const;
  protocol::Reply on(const protocol::WriteCalibration&, const Context& context) const;
  protocol::Reply on(const protocol::AlignReducer&, const Context& context) const;
  protocol::Reply on(const protocol::RestoreSettings&, const Context& context);
  protocol::Reply on(const protocol::RestoreCalibration&, const Context& context) const;
  /// Angle that 0x95 sets: its payload, or the bytes that it takes for a payload.
  std::int64_t zero_ram_angle(const protocol::ClearAngle& command, const Context& context) const;
  /// Applies a change of several RAM registers.
  void take_over_ram(const Lane& lane);

  void turn_off_after_trip(const model::Telemetry& telemetry);
  void start(const model::Telemetry& telemetry);
  void start_multi_turn(const model::Telemetry& telemetry, BootMultiTurn from);
  void apply_startup_faults();
  /// Applies faults to the multi-turn angle after a start.
  void apply_turn_faults(const model::Telemetry& telemetry);
  void arm_command_loss(LostAfter what);
  /// Index of this drive in multi-drive commands; nullopt above ID 4.
  std::optional<std::size_t> slot() const;
  /// Passes the registers to loops and protections.
  void configure(const Lane& lane) const { lane.configure(control_settings(ram_, format_)); }
  static Motion loop_motion(const model::Setpoint& setpoint);
  double within_max_speed(double speed_dps) const;
  std::int64_t within_max_angle(std::int64_t target_cdeg) const;
  /// Reapplies the limits to the command in force.
  void reapply_limits(const Lane& lane);
  Motion to_position(const CommandedPosition& position, double max_speed_dps) const;
  Motion to_multi_turn(std::int64_t target_cdeg, double max_speed_dps) const;
  std::optional<Motion> to_single_turn(const protocol::Position3& request, double max_speed_dps,
                                       const Context& context) const;
  Motion by_increment(std::int32_t increment_cdeg, double max_speed_dps,
                      const Context& context) const;
  /// Starts `motion`, unless it is absent (invalid target) or refused. Returns state 2 in any case.
  protocol::Reply execute(protocol::Opcode command, const std::optional<Motion>& motion,
                          const Context& context);
  /// Writes these parameters of `rom` to ROM in one write, except worn cells. Returns false if one
  /// could not be written.
  bool write_rom(std::span<const RomParameter> parameters, const Registers& rom);
  protocol::Reply state_1(protocol::Opcode command, const model::Telemetry& telemetry) const;
  protocol::Reply state_2(protocol::Opcode command, const model::Telemetry& telemetry) const;
  protocol::Opcode reply_opcode(protocol::Opcode command) const;

  /// State of a calibration by 0x18.
  struct Calibration {
    bool turned_back = false;
    std::int64_t from = 0;    // position at the start of this half
    std::int64_t travel = 0;  // counts in the halves before
  };
  static constexpr double kCalibrationTurns = 2;  // electrical turns to either side (decided)
  // A ratio out of this range means that the encoder does not follow the windings (decided).
  static constexpr double kLeastAlignRatio = 900, kMaxAlignRatio = 1100;

  ServoConfig config_;
  protocol::WireFormat format_;
  Registers rom_;
  RomWear wear_;
  Registers rom_before_;
  RomWear wear_before_{};
  Registers ram_;
  ShaftAngles angles_;
  RunState run_state_ = RunState::kRunning;
  bool tripped_ = false;        // a protection tripped; the drive has not run since
  Motion motion_;               // in force, or kept by a stop
  bool brake_powered_ = false;  // commanded state of the coil; power releases the brake
  // D[3:6] of the last packet that had them; initial value assumed (docs/reference/rs485.md).
  std::int32_t left_in_buffer_cdeg_ = 0x0100'0000;
  std::uint32_t starts_ = 0;
  OffHangs hung_ = OffHangs::kNo;
  bool loses_next_ = false;   // the next motion command is lost
  DriveAddress bus_address_;  // in force
  Registers pending_;         // parameters in pending_parameters_ wait here for 0x44
  std::bitset<kRomParameters> pending_parameters_;
  std::bitset<kRomParameters> saved_;    // last written by 0x44, with the values of pending_
  bool address_change_pending_ = false;  // to the address in `pending()`, after the reply
  bool restarts_ = false;
  std::optional<Calibration> calibration_;
  FirmwareFaults faults_;
  FirmwareFaults shown_faults_;
  ServoStats stats_;
};

}  // namespace lk::emulator
