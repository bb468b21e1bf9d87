#include "protocol/wire_format.hpp"

namespace lk::protocol {
namespace {

/// Is the command switched on, as far as it has a switch?
bool switched_on(const Dialect& dialect, Opcode opcode) {
  switch (opcode) {
    case Opcode::kReadPid:
    case Opcode::kWritePidToRam:
    case Opcode::kWritePidToRom:
    case Opcode::kReadAcceleration:
    case Opcode::kWriteAccelerationToRam:
      return dialect.pid_commands;
    case Opcode::kWriteOffsetToRom:
      return dialect.offset_command;
    case Opcode::kBrake:
      return dialect.brake_command;
    case Opcode::kOpenLoop:
      return dialect.open_loop_command;
    case Opcode::kReadParameter:
    case Opcode::kWriteParameter:
      return dialect.parameter_commands;
    case Opcode::kWriteZeroToRom:
    case Opcode::kOff:
    case Opcode::kStop:
    case Opcode::kRun:
    case Opcode::kReadEncoder:
    case Opcode::kReadMultiTurnAngle:
    case Opcode::kReadSingleTurnAngle:
    case Opcode::kClearAngle:
    case Opcode::kReadState1:
    case Opcode::kClearErrors:
    case Opcode::kReadState2:
    case Opcode::kReadState3:
    case Opcode::kTorque:
    case Opcode::kSpeed:
    case Opcode::kPosition1:
    case Opcode::kPosition2:
    case Opcode::kPosition3:
    case Opcode::kPosition4:
    case Opcode::kPosition5:
    case Opcode::kPosition6:
      return true;
  }
  return false;
}

}  // namespace

bool answers(const WireFormat& format, Opcode opcode) {
  const OpcodeRow* row = find_opcode(static_cast<std::uint8_t>(opcode));
  return row != nullptr && fits(row->fits, format.series) && switched_on(format.dialect, opcode);
}

bool knows_multi_drive(const WireFormat& format, std::uint32_t id) {
  const MultiDriveRow* row = find_multi_drive(id);
  return row != nullptr && fits(row->fits, format.series) &&
         (id == kMultiDriveId || format.dialect.multi_drive_more);
}

}  // namespace lk::protocol
