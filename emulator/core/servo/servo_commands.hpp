#pragma once

/// @file Execution of each command, and functions that the servo_*.cpp files share.

#include <cstdint>
#include <optional>
#include <span>

#include "emulator/core/servo/servo.hpp"
#include "protocol/commands.hpp"
#include "protocol/replies.hpp"

namespace lk::emulator {

/// Input of a command.
struct Context {
  const Query& query;
  const model::Telemetry& before;  // telemetry of the motor when the query ended
  const Lane& lane;
};

inline protocol::Echo echo(const Context& context) {
  return {context.query.data, context.query.size};
}

// `execute` carries out a command and returns its reply.

// servo_states.cpp: run state, brake, errors and measured values.
Reply execute(Servo& servo, const protocol::Off&, const Context& context);
Reply execute(Servo& servo, const protocol::Stop&, const Context& context);
Reply execute(Servo& servo, const protocol::Run&, const Context& context);
Reply execute(Servo& servo, const protocol::Brake& command, const Context& context);
Reply execute(Servo& servo, const protocol::Restart&, const Context& context);
Reply execute(const Servo& servo, const protocol::ReadState1&, const Context& context);
Reply execute(Servo& servo, const protocol::ClearErrors&, const Context& context);
Reply execute(const Servo& servo, const protocol::ReadState2&, const Context& context);
Reply execute(const Servo& servo, const protocol::ReadState3&, const Context& context);
Reply state_1_reply(const Servo& servo, protocol::Opcode command,
                    const model::Telemetry& telemetry);
Reply state_2_reply(const Servo& servo, protocol::Opcode command,
                    const model::Telemetry& telemetry);
void turn_off_after_trip(Servo& servo, const model::Telemetry& telemetry);

// servo_motion.cpp: set points of the loops, and the calibration, which turns the shaft.
Reply execute(Servo& servo, const protocol::OpenLoop& command, const Context& context);
Reply execute(Servo& servo, const protocol::Torque& command, const Context& context);
Reply execute(Servo& servo, const protocol::Speed& command, const Context& context);
Reply execute(Servo& servo, const protocol::Position1& command, const Context& context);
Reply execute(Servo& servo, const protocol::Position2& command, const Context& context);
Reply execute(Servo& servo, const protocol::Position3& command, const Context& context);
Reply execute(Servo& servo, const protocol::Position4& command, const Context& context);
Reply execute(Servo& servo, const protocol::Position5& command, const Context& context);
Reply execute(Servo& servo, const protocol::Position6& command, const Context& context);
Reply execute(Servo& servo, const protocol::MultiTorque& command, const Context& context);
Reply execute(Servo& servo, const protocol::MultiSpeed& command, const Context& context);
Reply execute(Servo& servo, const protocol::MultiPosition& command, const Context& context);
Reply execute(const Servo& servo, const protocol::MultiCommand&, const Context& context);
Reply execute(Servo& servo, const protocol::Calibrate&, const Context& context);
/// Applies changed limits in RAM to the motion command in force.
void reapply_limits(Servo& servo, const Lane& lane);

// servo_angles.cpp: encoder and angles.
Reply execute(const Servo& servo, const protocol::ReadEncoder& command, const Context& context);
Reply execute(Servo& servo, const protocol::WriteOffsetToRom& command, const Context& context);
Reply execute(Servo& servo, const protocol::WriteZeroToRom&, const Context& context);
Reply execute(const Servo& servo, const protocol::ReadMultiTurnAngle&, const Context& context);
Reply execute(const Servo& servo, const protocol::ReadSingleTurnAngle&, const Context& context);
Reply execute(Servo& servo, const protocol::ClearAngle& command, const Context& context);
Reply execute(Servo& servo, const protocol::ClearTurns&, const Context& context);
/// Sets the multi-turn angle after a start or after 0x80.
void start_multi_turn(Servo& servo, const model::Telemetry& telemetry, BootMultiTurn from);
/// Applies the encoder offset in RAM.
void apply_offset(Servo& servo);

// servo_settings.cpp: registers in RAM and ROM.
Reply execute(const Servo& servo, const protocol::ReadPid&, const Context& context);
Reply execute(Servo& servo, const protocol::WritePidToRam& command, const Context& context);
Reply execute(Servo& servo, const protocol::WritePidToRom& command, const Context& context);
Reply execute(const Servo& servo, const protocol::ReadAcceleration&, const Context& context);
Reply execute(Servo& servo, const protocol::WriteAccelerationToRam& command,
              const Context& context);
Reply execute(const Servo& servo, const protocol::ReadParameter& command, const Context& context);
Reply execute(Servo& servo, const protocol::WriteParameter& command, const Context& context);
Reply execute(const Servo& servo, const protocol::ReadMaxTorque&, const Context& context);
Reply execute(Servo& servo, const protocol::WriteMaxTorque& command, const Context& context);
Reply execute(const Servo& servo, const protocol::ReadStoredSetting& command,
              const Context& context);
Reply execute(Servo& servo, const protocol::WriteStoredSetting& command, const Context& context);
Reply execute(Servo& servo, const protocol::SaveSettings& command, const Context& context);
/// Passes the registers in RAM to control loops and protections.
void configure_loops(const Servo& servo, const Lane& lane);
/// Call after a change of several registers in RAM. Applies them to control loops, protections and
/// the motion command in force.
void apply_ram(Servo& servo, const Lane& lane);
/// Copies these parameters from `rom` to ROM in one write, except worn parameters. Returns false if
/// a parameter could not be written.
bool write_rom(Servo& servo, std::span<const RomParameter> parameters, const Registers& rom);

// servo_serial.cpp: settings over RS-485, and the blocks of the vendor's tool.
Reply execute(const Servo& servo, const protocol::ReadSetting& command, const Context& context);
Reply execute(Servo& servo, const protocol::WriteSettingToRam& command, const Context& context);
Reply execute(Servo& servo, const protocol::WriteSettingToRom& command, const Context& context);
Reply execute(const Servo& servo, const protocol::Restore&, const Context& context);
Reply execute(const Servo& servo, const protocol::Connect&, const Context& context);
Reply execute(const Servo& servo, const protocol::Disconnect&, const Context& context);
Reply execute(const Servo& servo, const protocol::ReadProduct&, const Context& context);
Reply execute(const Servo& servo, const protocol::ReadDeviceType&, const Context& context);
Reply execute(const Servo& servo, const protocol::ReadSettingsBlock&, const Context& context);
Reply execute(Servo& servo, const protocol::WriteSettingsBlock&, const Context& context);
Reply execute(const Servo& servo, const protocol::ReadCalibration&, const Context& context);
Reply execute(const Servo& servo, const protocol::WriteCalibration&, const Context& context);
Reply execute(const Servo& servo, const protocol::AlignReducer&, const Context& context);
Reply execute(Servo& servo, const protocol::RestoreSettings&, const Context& context);
Reply execute(const Servo& servo, const protocol::RestoreCalibration&, const Context& context);

// servo_faults.cpp: injected faults.
/// Applies the injected faults to RAM after a start.
void apply_startup_faults(Servo& servo);
/// Applies the injected faults to the multi-turn angle after a start.
void apply_turn_faults(Servo& servo, const model::Telemetry& telemetry);
void arm_command_loss(Servo& servo, LostAfter what);

}  // namespace lk::emulator
