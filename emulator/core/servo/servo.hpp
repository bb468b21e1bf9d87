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

/// After what a drive answers its next motion command and does not execute it.
enum class LostAfter : std::uint8_t { kBoot, kLostInput, kClear, kOff };

/// Injected faults of firmware and memory that last.
struct FirmwareFaults {
  bool rom_write_fails = false;
  bool rom_worn = false;
  bool forgets_broadcast = false;
  bool forgets_limits = false;
  bool clear_reply_before = false;
  bool first_command_lost = false;
  LostAfter lost_after = LostAfter::kLostInput;
  bool hangs_after_off = false;
  OffHangs off_hangs = OffHangs::kNo;  // then
  bool encoder_wrap_at_boot = false;
  int turns_at_boot = 0;  // by which the multi-turn angle is off
  bool multi_turn_zero_at_boot = false;
};

enum class RunState : std::uint8_t { kOff, kStopped, kRunning };

/// A drive with an ID: the firmware between the wire and the motor. Registers, run state, angles,
/// and what each command does; moves no motor itself. A value.
class Servo {
 public:
  /// `boot` is what the motor's bank says before its first tick.
  Servo(const ServoConfig& config, const model::Telemetry& boot);

  /// Its name, whatever ID it answers at.
  int id() const { return config_.id; }
  /// Where it is found: the ID in force, the bus and the bit rates that it is set to.
  const DrivePlace& place() const { return place_; }
  /// ROM has another place than that in force.
  bool moves_at_start() const {
    return rom_.driver_id != ram_.driver_id || rom_.bus_type != ram_.bus_type ||
           rom_.serial_rate != ram_.serial_rate || rom_.can_rate != ram_.can_rate;
  }
  int address() const { return place_.id; }
  bool on_its_bus() const { return is_on_its_bus(place_, config_); }
  bool at_its_rate() const { return is_at_its_rate(place_, config_); }
  /// What ROM will hold, and say of its place at the next start, once 0x44 has saved it.
  Registers pending() const;
  /// The value of the setting that 0x40 reads.
  protocol::StoredSetting shown_setting(const protocol::StoredSetting& which) const;
  /// Settings that wait for 0x44.
  bool has_pending() const { return touched_.any(); }
  const ServoConfig& config() const { return config_; }
  SimTime reply_time() const { return config_.reply_time; }
  /// Answers the commands for several drives only.
  bool multi_drive_mode() const { return ram_.broadcast_mode; }
  /// How it speaks.
  const protocol::WireFormat& format() const { return format_; }
  const Registers& ram() const { return ram_; }
  const Registers& rom() const { return rom_; }
  const RomWear& wear() const { return wear_; }
  // What the last write to ROM replaced.
  const Registers& rom_before() const { return rom_before_; }
  const RomWear& wear_before() const { return wear_before_; }
  const ServoStats& stats() const { return stats_; }
  // What the wire would say, of a motor in that state.
  /// A protection that trips turns the bridge off at once, whether or not somebody asks since.
  RunState run_state(const model::Telemetry& telemetry) const {
    return telemetry.errors != 0 ? RunState::kOff : run_state_;
  }
  double multi_turn_deg(const model::Telemetry& telemetry) const {
    return 0.01 * static_cast<double>(angles_.multi_turn_cdeg(angles_.position(telemetry)));
  }
  std::uint16_t encoder_counts(const model::Telemetry& telemetry) const {
    return angles_.encoder(angles_.position(telemetry), ram_.encoder_offset);
  }
  /// The multi-turn angle that a position of the loops (model::Position) has.
  double multi_turn_deg_of(double theta) const { return angles_.multi_turn_deg(theta); }

  /// What a frame asks of this servo, told of its own kind; kForeignId or kUnknownCommand when it
  /// is nothing that this drive answers.
  std::variant<protocol::Query, protocol::Reject> understand(const protocol::Frame& frame) const;
  /// Executes a query that this servo has understood and gives its reply. The motor stands where it
  /// stands when the query's last bit arrives; the reply tells that state, the query changes the
  /// next.
  protocol::Reply handle(const protocol::Query& query, const Lane& lane);
  /// Identifier of its replies.
  std::uint32_t reply_id() const {
    return format_.dialect.reply_id_base + static_cast<std::uint32_t>(address());
  }
  protocol::Frame encode(const protocol::Reply& reply) const {
    return protocol::encode_reply(address(), reply, format_);
  }
  /// 0x07 has been handled since the last call: the controller is to start anew.
  bool take_restart() { return std::exchange(restarts_, false); }
  /// The ID or the rate that the last query has brought into force without a restart is in force
  /// from now on. Returns false when there is none.
  bool take_move();
  /// 0x18 turns the shaft, and there is no reply yet.
  bool calibrating() const { return calibration_.has_value(); }
  /// It obeys nothing meanwhile, and answers nothing either where calibrate_busy says so.
  bool deaf_while_calibrating() const {
    return calibrating() && config_.quirks.calibrate_busy == CalibrateBusy::kSilent;
  }
  /// A part of the time of 0x18 has passed. Returns whether another one follows.
  bool turn_back(const Lane& lane);
  /// All of it has; the drive is calibrating. `random` chooses the align value.
  protocol::Reply finish_calibration(const Lane& lane, std::uint64_t random);
  /// It answers at `id` from now on, and keeps that in ROM.
  void change_id(int id);
  /// A packet of RS-485 with this drive's ID arrived: 0x95 may look at what is left of it.
  void keep_received(const protocol::Frame& packet);
  /// Its reply to 0x9B shows the errors from before it cleared them.
  bool clear_reply_before() const {
    return faults_.clear_reply_before || config_.quirks.clear_reply == ClearReply::kBefore;
  }
  /// How often its controller has started, power-up included.
  std::uint32_t starts() const { return starts_; }
  /// It obeys, and nothing that it says leaves it until it starts anew.
  bool is_mute() const { return hung_ != OffHangs::kNo; }
  /// On RS-485 it holds the line, so no other drive is heard either.
  bool keeps_line() const { return hung_ == OffHangs::kBus; }
  /// That showed on a frame of others.
  void show_kept_line() { shown_faults_.hangs_after_off |= faults_.hangs_after_off; }
  /// A frame with an unknown command byte arrived; a single-drive one in multi-drive mode did.
  void count_unknown_command() { ++stats_.unknown_commands; }
  void count_wrong_mode() { ++stats_.wrong_mode; }

  /// Somebody at the drive, not on the wire, writes a setting: `parameter` becomes what it is in
  /// `value`, which the drive must be able to hold, in RAM and in ROM.
  void write_setting(RomParameter parameter, const Registers& value, const Lane& lane);
  /// ROM holds this from now on.
  void restore_rom(const Registers& rom, const RomWear& wear);

  /// What is wrong with the firmware and its memory, from now on.
  void set_faults(const FirmwareFaults& faults) { faults_ = faults; }
  /// What of that has shown since the last call.
  FirmwareFaults take_shown_faults() { return std::exchange(shown_faults_, {}); }
  /// A parameter of ROM is as delivered, from now on, and ROM has another number of changes.
  /// Returns false when it was so before.
  bool damage_rom(RomParameter parameter);
  /// A bit of a setting in RAM flips; `random` chooses it. Returns false when the register holds
  /// nothing else.
  bool flip_ram(RomParameter parameter, std::uint64_t random, const Lane& lane);

  /// The controller has started: ROM stays, RAM, turn count, errors and command are gone.
  void power_cycle(const Lane& lane);

 private:
  struct Context {
    const protocol::Query& query;
    const model::Telemetry& before;
    const Lane& lane;
  };
  /// A motion command, in the terms of the loops.
  struct Motion {
    model::Setpoint setpoint = model::Idle{};
    std::optional<CommandedPosition> position;       // of position commands
    std::optional<protocol::Position3> single_turn;  // of 0xA5/0xA6: what was asked for
    // What was asked for before a register limited it, which may change.
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
  /// The place in `pending()` is in force after the reply.
  void move();
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
  /// What 0x95 makes of its payload, or of what it takes for one.
  std::int64_t zero_ram_angle(const protocol::ClearAngle& command, const Context& context) const;
  /// RAM has changed as a whole.
  void take_over_ram(const Lane& lane);

  void turn_off_after_trip(const model::Telemetry& telemetry);
  void wake_up(const model::Telemetry& telemetry);
  void start_multi_turn(const model::Telemetry& telemetry, BootMultiTurn from);
  void forget_what_faults_forget();
  /// Faults change the multi-turn angle that the drive has woken up with.
  void misread_turns(const model::Telemetry& telemetry);
  void lose_next_after(LostAfter what);
  /// The place of this drive in the commands for several; none above ID 4.
  std::optional<std::size_t> slot() const;
  /// The loops and protections read the registers again.
  void configure(const Lane& lane) const { lane.configure(control_settings(ram_, format_)); }
  static Motion loop_motion(const model::Setpoint& setpoint);
  double within_max_speed(double speed_dps) const;
  std::int64_t within_max_angle(std::int64_t target_cdeg) const;
  /// The limits of a command in force have changed.
  void limit_anew(const Lane& lane);
  Motion to_position(const CommandedPosition& position, double max_speed_dps) const;
  Motion to_multi_turn(std::int64_t target_cdeg, double max_speed_dps) const;
  std::optional<Motion> to_single_turn(const protocol::Position3& request, double max_speed_dps,
                                       const Context& context) const;
  Motion by_increment(std::int32_t increment_cdeg, double max_speed_dps,
                      const Context& context) const;
  /// Starts `motion` unless it is none (an invalid target), or the drive is off and waits for 0x88;
  /// state 2 in any case.
  protocol::Reply execute(protocol::Opcode command, const std::optional<Motion>& motion,
                          const Context& context);
  /// These registers of ROM become what `rom` says, in one write, but for worn out cells. Returns
  /// false when one did not.
  bool write_rom(std::span<const RomParameter> parameters, const Registers& rom);
  protocol::Reply state_1(protocol::Opcode command, const model::Telemetry& telemetry) const;
  protocol::Reply state_2(protocol::Opcode command, const model::Telemetry& telemetry) const;
  protocol::Opcode reply_opcode(protocol::Opcode command) const;

  /// A run of 0x18.
  struct Calibration {
    bool turned_back = false;
    std::int64_t from = 0;    // position in which this half began
    std::int64_t travel = 0;  // counts, of the halves before
  };
  static constexpr double kCalibrationTurns = 2;  // electrical, to either side (decided)
  // A ratio beyond these means that the encoder does not follow the windings (decided).
  static constexpr double kLeastAlignRatio = 900, kMostAlignRatio = 1100;

  ServoConfig config_;
  protocol::WireFormat format_;
  Registers rom_;
  RomWear wear_;
  Registers rom_before_;
  RomWear wear_before_{};
  Registers ram_;
  ShaftAngles angles_;
  RunState run_state_ = RunState::kRunning;
  bool tripped_ = false;        // and not switched on since
  Motion motion_;               // in force, or kept by a stop
  bool brake_powered_ = false;  // the coil, as commanded; released while it is powered
  // D[3:6] of the last packet that had them; assumed before there is one (docs/rs485.md).
  std::int32_t left_in_buffer_cdeg_ = 0x0100'0000;
  std::uint32_t starts_ = 0;
  OffHangs hung_ = OffHangs::kNo;
  bool loses_next_ = false;  // motion command
  DrivePlace place_;         // in force
  Registers pending_;        // those of touched_ wait for 0x44
  std::bitset<kRomParameters> touched_;
  std::bitset<kRomParameters> saved_;  // written last by 0x44, with the values of pending_
  bool moves_ = false;                 // to the place in `pending()`, after the reply
  bool restarts_ = false;
  std::optional<Calibration> calibration_;
  FirmwareFaults faults_;
  FirmwareFaults shown_faults_;
  ServoStats stats_;
};

}  // namespace lk::emulator
