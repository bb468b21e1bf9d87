#include <algorithm>
#include <cassert>

#include "protocol/codec.hpp"
#include "protocol/parameter_codec.hpp"
#include "protocol/wire.hpp"

namespace lk::protocol {
namespace {

constexpr double kSpeedLsb_dps = 0.01;

double get_iq_A(const Payload& data, std::size_t at, const WireFormat& format) {
  const auto limit = format.dialect.iq_command_limit_lsb;
  const auto held =
      std::clamp(get_le<std::int16_t>(data, at), static_cast<std::int16_t>(-limit), limit);
  return held * format.iq_command_lsb_A;
}

void put_iq_A(Payload& data, std::size_t at, double iq_A, const WireFormat& format) {
  const auto limit = format.dialect.iq_command_limit_lsb;
  put_le(data, at,
         quantize<std::int16_t>(iq_A, format.iq_command_lsb_A, static_cast<std::int16_t>(-limit),
                                limit));
}

Speed get_speed(const Payload& data, const WireFormat& format) {
  Speed command{.speed_dps = get_le<std::int32_t>(data, 4) * kSpeedLsb_dps};
  if (format.dialect.speed_iq_limit) {
    command.iq_limit_A = std::max(get_iq_A(data, 2, format), 0.0);
  }
  return command;
}

std::uint32_t get_single_turn_target(const Payload& data, const WireFormat& format) {
  return format.dialect.wide_single_turn_target ? get_le<std::uint32_t>(data, 4)
                                                : get_le<std::uint16_t>(data, 4);
}

void put_single_turn_target(Payload& data, std::uint32_t target_cdeg, const WireFormat& format) {
  if (format.dialect.wide_single_turn_target) {
    put_le(data, 4, target_cdeg);
  } else {
    put_le(data, 4, static_cast<std::uint16_t>(std::min(target_cdeg, kUint16Max)));
  }
}

ClearAngle get_clear_angle(const Payload& data, const WireFormat& format) {
  const bool sets = format.dialect.clear_angle == ClearAngleMeaning::kSetsAngle;
  return {sets ? get_le<std::int32_t>(data, 4) : 0};
}

std::int16_t get_power_permille(const Payload& data) {
  return std::clamp(get_le<std::int16_t>(data, 4),
                    static_cast<std::int16_t>(-kOpenLoopLimit_permille), kOpenLoopLimit_permille);
}

PidGains get_gains(const Payload& data) {
  return {.angle_kp = data[2],
          .angle_ki = data[3],
          .speed_kp = data[4],
          .speed_ki = data[5],
          .iq_kp = data[6],
          .iq_ki = data[7]};
}

void put_gains(Payload& data, const PidGains& gains) {
  data[2] = gains.angle_kp;
  data[3] = gains.angle_ki;
  data[4] = gains.speed_kp;
  data[5] = gains.speed_ki;
  data[6] = gains.iq_kp;
  data[7] = gains.iq_ki;
}

/// The payload of one of kMultiDriveRows.
Command decode_multi(std::uint32_t id, const Payload& data, const WireFormat& format) {
  if (id == kMultiSpeedId) {
    MultiSpeed command;
    for (std::size_t slot = 0; slot < command.speed_dps.size(); ++slot) {
      command.speed_dps[slot] = get_le<std::int16_t>(data, 2 * slot);
    }
    return command;
  }
  if (id == kMultiPositionId) {
    MultiPosition command;
    for (std::size_t slot = 0; slot < command.target_deg.size(); ++slot) {
      command.target_deg[slot] = get_le<std::int16_t>(data, 2 * slot);
    }
    return command;
  }
  if (id == kMultiCommandId) {
    MultiCommand command;
    for (std::size_t slot = 0; slot < command.opcodes.size(); ++slot) {
      command.opcodes[slot] = data[2 * slot];
    }
    return command;
  }
  assert(id == kMultiDriveId);
  MultiTorque command;
  for (std::size_t slot = 0; slot < command.iq_A.size(); ++slot) {
    command.iq_A[slot] = get_iq_A(data, 2 * slot, format);
  }
  return command;
}

Command decode_single(Opcode opcode, const Payload& data, const WireFormat& format) {
  switch (opcode) {
    case Opcode::kWriteZeroToRom:
      return WriteZeroToRom{};
    case Opcode::kReadPid:
      return ReadPid{};
    case Opcode::kWritePidToRam:
      return WritePidToRam{get_gains(data)};
    case Opcode::kWritePidToRom:
      return WritePidToRom{get_gains(data)};
    case Opcode::kReadAcceleration:
      return ReadAcceleration{};
    case Opcode::kWriteAccelerationToRam:
      return WriteAccelerationToRam{get_le<std::int32_t>(data, 4)};
    case Opcode::kOff:
      return Off{};
    case Opcode::kStop:
      return Stop{};
    case Opcode::kRun:
      return Run{};
    case Opcode::kBrake:
      return Brake{data[1]};
    case Opcode::kReadEncoder:
      return ReadEncoder{};
    case Opcode::kWriteOffsetToRom:
      return WriteOffsetToRom{get_le<std::uint16_t>(data, 6)};
    case Opcode::kReadMultiTurnAngle:
      return ReadMultiTurnAngle{};
    case Opcode::kReadSingleTurnAngle:
      return ReadSingleTurnAngle{};
    case Opcode::kClearAngle:
      return get_clear_angle(data, format);
    case Opcode::kReadState1:
      return ReadState1{};
    case Opcode::kClearErrors:
      return ClearErrors{};
    case Opcode::kReadState2:
      return ReadState2{};
    case Opcode::kReadState3:
      return ReadState3{};
    case Opcode::kOpenLoop:
      return OpenLoop{get_power_permille(data)};
    case Opcode::kTorque:
      return Torque{get_iq_A(data, 4, format)};
    case Opcode::kSpeed:
      return get_speed(data, format);
    case Opcode::kPosition1:
      return Position1{get_le<std::int32_t>(data, 4)};
    case Opcode::kPosition2:
      return Position2{get_le<std::uint16_t>(data, 2), get_le<std::int32_t>(data, 4)};
    case Opcode::kPosition3:
      return Position3{data[1], get_single_turn_target(data, format)};
    case Opcode::kPosition4:
      return Position4{data[1], get_le<std::uint16_t>(data, 2),
                       get_single_turn_target(data, format)};
    case Opcode::kPosition5:
      return Position5{get_le<std::int32_t>(data, 4)};
    case Opcode::kPosition6:
      return Position6{get_le<std::uint16_t>(data, 2), get_le<std::int32_t>(data, 4)};
    case Opcode::kReadParameter:
      return ReadParameter{static_cast<ParameterId>(data[1])};
    case Opcode::kWriteParameter:
      return WriteParameter{get_parameter(data)};
  }
  assert(false && "an opcode comes from the table");
  return ReadState2{};
}

/// Writes DATA of one command. The overloads stand in the order of the table.
struct QueryWriter {
  Payload& data;
  const WireFormat& format;

  void start(Opcode opcode) const { data[0] = static_cast<std::uint8_t>(opcode); }

  void operator()(const WriteZeroToRom&) const { start(Opcode::kWriteZeroToRom); }
  void operator()(const ReadPid&) const { start(Opcode::kReadPid); }
  void operator()(const WritePidToRam& command) const {
    start(Opcode::kWritePidToRam);
    put_gains(data, command.gains);
  }
  void operator()(const WritePidToRom& command) const {
    start(Opcode::kWritePidToRom);
    put_gains(data, command.gains);
  }
  void operator()(const ReadAcceleration&) const { start(Opcode::kReadAcceleration); }
  void operator()(const WriteAccelerationToRam& command) const {
    start(Opcode::kWriteAccelerationToRam);
    put_le(data, 4, command.acceleration_dps_s);
  }
  void operator()(const Off&) const { start(Opcode::kOff); }
  void operator()(const Stop&) const { start(Opcode::kStop); }
  void operator()(const Run&) const { start(Opcode::kRun); }
  void operator()(const Brake& command) const {
    start(Opcode::kBrake);
    data[1] = command.action;
  }
  void operator()(const ReadEncoder&) const { start(Opcode::kReadEncoder); }
  void operator()(const WriteOffsetToRom& command) const {
    start(Opcode::kWriteOffsetToRom);
    put_le(data, 6, command.offset_counts);
  }
  void operator()(const ReadMultiTurnAngle&) const { start(Opcode::kReadMultiTurnAngle); }
  void operator()(const ReadSingleTurnAngle&) const { start(Opcode::kReadSingleTurnAngle); }
  void operator()(const ClearAngle& command) const {
    start(Opcode::kClearAngle);
    if (format.dialect.clear_angle == ClearAngleMeaning::kSetsAngle) {
      put_le(data, 4, command.angle_cdeg);
    }
  }
  void operator()(const ReadState1&) const { start(Opcode::kReadState1); }
  void operator()(const ClearErrors&) const { start(Opcode::kClearErrors); }
  void operator()(const ReadState2&) const { start(Opcode::kReadState2); }
  void operator()(const ReadState3&) const { start(Opcode::kReadState3); }
  void operator()(const OpenLoop& command) const {
    start(Opcode::kOpenLoop);
    put_le(data, 4,
           std::clamp(command.power_permille, static_cast<std::int16_t>(-kOpenLoopLimit_permille),
                      kOpenLoopLimit_permille));
  }
  void operator()(const Torque& command) const {
    start(Opcode::kTorque);
    put_iq_A(data, 4, command.iq_A, format);
  }
  void operator()(const Speed& command) const {
    start(Opcode::kSpeed);
    if (format.dialect.speed_iq_limit) {
      put_iq_A(data, 2, std::max(command.iq_limit_A, 0.0), format);
    }
    put_le(data, 4, quantize<std::int32_t>(command.speed_dps, kSpeedLsb_dps));
  }
  void operator()(const Position1& command) const {
    start(Opcode::kPosition1);
    put_le(data, 4, command.target_cdeg);
  }
  void operator()(const Position2& command) const {
    start(Opcode::kPosition2);
    put_le(data, 2, command.max_speed_dps);
    put_le(data, 4, command.target_cdeg);
  }
  void operator()(const Position3& command) const {
    start(Opcode::kPosition3);
    data[1] = command.direction;
    put_single_turn_target(data, command.target_cdeg, format);
  }
  void operator()(const Position4& command) const {
    start(Opcode::kPosition4);
    data[1] = command.direction;
    put_le(data, 2, command.max_speed_dps);
    put_single_turn_target(data, command.target_cdeg, format);
  }
  void operator()(const Position5& command) const {
    start(Opcode::kPosition5);
    put_le(data, 4, command.increment_cdeg);
  }
  void operator()(const Position6& command) const {
    start(Opcode::kPosition6);
    put_le(data, 2, command.max_speed_dps);
    put_le(data, 4, command.increment_cdeg);
  }
  void operator()(const ReadParameter& command) const {
    start(Opcode::kReadParameter);
    data[1] = static_cast<std::uint8_t>(command.id);
  }
  void operator()(const WriteParameter& command) const {
    start(Opcode::kWriteParameter);
    put_parameter(data, command.parameter);
  }
  void operator()(const MultiTorque& command) const {
    for (std::size_t slot = 0; slot < command.iq_A.size(); ++slot) {
      put_iq_A(data, 2 * slot, command.iq_A[slot], format);
    }
  }
  void operator()(const MultiSpeed& command) const {
    for (std::size_t slot = 0; slot < command.speed_dps.size(); ++slot) {
      put_le(data, 2 * slot, command.speed_dps[slot]);
    }
  }
  void operator()(const MultiPosition& command) const {
    for (std::size_t slot = 0; slot < command.target_deg.size(); ++slot) {
      put_le(data, 2 * slot, command.target_deg[slot]);
    }
  }
  void operator()(const MultiCommand& command) const {
    for (std::size_t slot = 0; slot < command.opcodes.size(); ++slot) {
      data[2 * slot] = command.opcodes[slot];
    }
  }
};

/// The identifier of a query; `id` is that of the drive, where there is one.
std::uint32_t identifier(int id, const Command& command) {
  if (std::holds_alternative<MultiTorque>(command)) {
    return kMultiDriveId;
  }
  if (std::holds_alternative<MultiSpeed>(command)) {
    return kMultiSpeedId;
  }
  if (std::holds_alternative<MultiPosition>(command)) {
    return kMultiPositionId;
  }
  if (std::holds_alternative<MultiCommand>(command)) {
    return kMultiCommandId;
  }
  assert(id >= kMinId && id <= kMaxId);
  return kSingleDriveId + static_cast<std::uint32_t>(id);
}

/// A query to one drive.
std::variant<Query, Reject> decode_single(int id, const Payload& data, const WireFormat& format) {
  const OpcodeRow* row = find_opcode(data[0]);
  if (row == nullptr || !answers(format, row->opcode)) {
    return Reject::kUnknownCommand;
  }
  const bool parameter =
      row->opcode == Opcode::kReadParameter || row->opcode == Opcode::kWriteParameter;
  if (parameter && !known_parameter(data[1])) {
    return Reject::kUnknownCommand;
  }
  return Query{id, decode_single(row->opcode, data, format), data};
}

}  // namespace

std::variant<int, Reject> address(const Frame& frame) {
  switch (frame.kind) {
    case FrameKind::kError:
      return Reject::kErrorFrame;
    case FrameKind::kFd:
      return Reject::kCanFd;
    case FrameKind::kRemote:
      return Reject::kRemote;
    case FrameKind::kData:
      break;
  }
  if (frame.extended) {
    return Reject::kExtended;
  }
  const bool single = frame.id >= kSingleDriveId + kMinId && frame.id <= kSingleDriveId + kMaxId;
  if (!single && find_multi_drive(frame.id) == nullptr) {
    return Reject::kForeignId;
  }
  if (frame.dlc != frame.data.size()) {
    return Reject::kWrongLength;
  }
  return single ? static_cast<int>(frame.id - kSingleDriveId) : kMultiDrive;
}

std::variant<Query, Reject> decode_query(const Frame& frame, const WireFormat& format) {
  const auto addressed = address(frame);
  if (const auto* reject = std::get_if<Reject>(&addressed)) {
    return *reject;
  }
  const int id = std::get<int>(addressed);
  if (id != kMultiDrive) {
    return decode_single(id, frame.data, format);
  }
  if (!knows_multi_drive(format, frame.id)) {
    return frame.id == kMultiDriveId ? Reject::kUnknownCommand : Reject::kForeignId;
  }
  return Query{id, decode_multi(frame.id, frame.data, format), frame.data};
}

std::variant<Query, Reject> for_drive(int id, const Query& query, const WireFormat& format) {
  const auto* multi = std::get_if<MultiCommand>(&query.command);
  if (multi == nullptr) {
    return query;
  }
  const auto slot = static_cast<std::size_t>(id - kMinId);
  if (slot >= multi->opcodes.size() || multi->opcodes[slot] == kNoCommand) {
    return Reject::kForeignId;
  }
  return decode_single(id, Payload{multi->opcodes[slot]}, format);
}

Frame encode_query(int id, const Command& command, const WireFormat& format) {
  Frame frame;
  frame.id = identifier(id, command);
  std::visit(QueryWriter{frame.data, format}, command);
  return frame;
}

}  // namespace lk::protocol
