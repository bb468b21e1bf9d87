#include <algorithm>
#include <cassert>

#include "protocol/codec.hpp"
#include "protocol/parameter_codec.hpp"
#include "protocol/wire.hpp"

namespace lk::protocol {
namespace {

void put_temperature_C(Payload& data, double temperature_C) {
  put_le(data, 1, quantize<std::int8_t>(temperature_C, 1.0));
}

double get_temperature_C(const Payload& data) { return get_le<std::int8_t>(data, 1); }

constexpr double kBusCurrentLsb_A = 0.01;
constexpr std::uint8_t kStateOn = 0x00;
constexpr std::uint8_t kStateOff = 0x10;
constexpr double kPowerLsb = 1e-3;

/// The iq field of state 2, which carries power on MS drives.
void put_effort(Payload& data, const State2& reply, const WireFormat& format) {
  const bool power = format.series == Series::kMs;
  const std::int16_t limit = power ? kPowerReplyLimit_permille : kIqReplyLimit_lsb;
  put_le(data, 2,
         quantize<std::int16_t>(power ? reply.power : reply.iq_A,
                                power ? kPowerLsb : format.iq_reply_lsb_A,
                                static_cast<std::int16_t>(-limit), limit));
}

/// Writes DATA of one reply.
struct ReplyWriter {
  Payload& data;
  const WireFormat& format;

  void start(Opcode opcode) const { data[0] = static_cast<std::uint8_t>(opcode); }

  void operator()(const Echo& reply) const { data = reply.data; }

  void operator()(const ZeroWritten& reply) const {
    start(Opcode::kWriteZeroToRom);
    put_le(data, 6, reply.offset_counts);
  }
  void operator()(const Pid& reply) const {
    start(Opcode::kReadPid);
    data[2] = reply.gains.angle_kp;
    data[3] = reply.gains.angle_ki;
    data[4] = reply.gains.speed_kp;
    data[5] = reply.gains.speed_ki;
    data[6] = reply.gains.iq_kp;
    data[7] = reply.gains.iq_ki;
  }
  void operator()(const Acceleration& reply) const {
    start(Opcode::kReadAcceleration);
    put_le(data, 4, reply.acceleration_dps_s);
  }
  void operator()(const BrakeState& reply) const {
    start(Opcode::kBrake);
    data[1] = reply.coil_powered ? 1 : 0;
  }
  void operator()(const Encoder& reply) const {
    start(Opcode::kReadEncoder);
    put_le(data, 2, reply.encoder_counts);
    put_le(data, 4, reply.raw_counts);
    put_le(data, 6, reply.offset_counts);
  }
  void operator()(const MultiTurnAngle& reply) const {
    start(Opcode::kReadMultiTurnAngle);
    put_le56(data, reply.angle_cdeg);
  }
  void operator()(const SingleTurnAngle& reply) const {
    start(Opcode::kReadSingleTurnAngle);
    if (format.dialect.wide_single_turn) {
      put_le(data, 4, reply.angle_cdeg);
    } else {
      put_le(data, 6, static_cast<std::uint16_t>(std::min(reply.angle_cdeg, kUint16Max)));
    }
  }
  void operator()(const State1& reply) const {
    start(reply.command);
    put_temperature_C(data, reply.temperature_C);
    const auto voltage = quantize<std::uint16_t>(reply.voltage_V, format.voltage_lsb_V);
    switch (format.dialect.state_1) {
      case State1Layout::kDeciVolt:
        put_le(data, 3, voltage);
        break;
      case State1Layout::kCentiVolt:
        put_le(data, 2, voltage);
        break;
      case State1Layout::kCentiVoltAndBusCurrent:
        put_le(data, 2, voltage);
        put_le(data, 4, quantize<std::int16_t>(reply.bus_current_A, kBusCurrentLsb_A));
        data[6] = reply.bridge_on ? kStateOn : kStateOff;
        break;
    }
    data[7] = reply.errors;
  }
  void operator()(const State2& reply) const {
    start(reply.command);
    put_temperature_C(data, reply.temperature_C);
    put_effort(data, reply, format);
    put_le(data, 4, quantize<std::int16_t>(reply.speed_dps, 1.0));
    put_le(data, 6, reply.encoder_counts);
  }
  void operator()(const State3& reply) const {
    start(Opcode::kReadState3);
    put_temperature_C(data, reply.temperature_C);
    put_le(data, 2, quantize<std::int16_t>(reply.i_a_A, format.phase_current_lsb_A));
    put_le(data, 4, quantize<std::int16_t>(reply.i_b_A, format.phase_current_lsb_A));
    put_le(data, 6, quantize<std::int16_t>(reply.i_c_A, format.phase_current_lsb_A));
  }
  void operator()(const ParameterValue& reply) const {
    start(Opcode::kReadParameter);
    put_parameter(data, reply.parameter);
  }
};

State1 read_state_1(Opcode command, const Payload& data, const WireFormat& format) {
  State1 reply{.command = command,
               .temperature_C = get_temperature_C(data),
               .voltage_V = 0,
               .errors = data[7]};
  switch (format.dialect.state_1) {
    case State1Layout::kDeciVolt:
      reply.voltage_V = get_le<std::uint16_t>(data, 3) * format.voltage_lsb_V;
      break;
    case State1Layout::kCentiVolt:
      reply.voltage_V = get_le<std::uint16_t>(data, 2) * format.voltage_lsb_V;
      break;
    case State1Layout::kCentiVoltAndBusCurrent:
      reply.voltage_V = get_le<std::uint16_t>(data, 2) * format.voltage_lsb_V;
      reply.bus_current_A = get_le<std::int16_t>(data, 4) * kBusCurrentLsb_A;
      reply.bridge_on = data[6] != kStateOff;
      break;
  }
  return reply;
}

State2 read_state_2(Opcode command, const Payload& data, const WireFormat& format) {
  const bool power = format.series == Series::kMs;
  const auto effort = get_le<std::int16_t>(data, 2);
  return {.command = command,
          .temperature_C = get_temperature_C(data),
          .iq_A = power ? 0 : effort * format.iq_reply_lsb_A,
          .speed_dps = static_cast<double>(get_le<std::int16_t>(data, 4)),
          .encoder_counts = get_le<std::uint16_t>(data, 6),
          .power = power ? effort * kPowerLsb : 0};
}

State3 read_state_3(const Payload& data, const WireFormat& format) {
  return {.temperature_C = get_temperature_C(data),
          .i_a_A = get_le<std::int16_t>(data, 2) * format.phase_current_lsb_A,
          .i_b_A = get_le<std::int16_t>(data, 4) * format.phase_current_lsb_A,
          .i_c_A = get_le<std::int16_t>(data, 6) * format.phase_current_lsb_A};
}

Reply read_reply(Opcode opcode, const Payload& data, const WireFormat& format) {
  switch (opcode) {
    case Opcode::kWriteZeroToRom:
      return ZeroWritten{get_le<std::uint16_t>(data, 6)};
    case Opcode::kReadPid:
      return Pid{{data[2], data[3], data[4], data[5], data[6], data[7]}};
    case Opcode::kReadAcceleration:
      return Acceleration{get_le<std::int32_t>(data, 4)};
    case Opcode::kBrake:
      return BrakeState{data[1] != 0};
    case Opcode::kReadEncoder:
      return Encoder{get_le<std::uint16_t>(data, 2), get_le<std::uint16_t>(data, 4),
                     get_le<std::uint16_t>(data, 6)};
    case Opcode::kReadMultiTurnAngle:
      return MultiTurnAngle{get_le56(data)};
    case Opcode::kReadSingleTurnAngle:
      return SingleTurnAngle{format.dialect.wide_single_turn ? get_le<std::uint32_t>(data, 4)
                                                             : get_le<std::uint16_t>(data, 6)};
    case Opcode::kReadState1:
    case Opcode::kClearErrors:
      return read_state_1(opcode, data, format);
    case Opcode::kReadState2:
    case Opcode::kOpenLoop:
    case Opcode::kTorque:
    case Opcode::kSpeed:
    case Opcode::kPosition1:
    case Opcode::kPosition2:
    case Opcode::kPosition3:
    case Opcode::kPosition4:
    case Opcode::kPosition5:
    case Opcode::kPosition6:
      return read_state_2(opcode, data, format);
    case Opcode::kReadState3:
      return read_state_3(data, format);
    case Opcode::kWritePidToRam:
    case Opcode::kWritePidToRom:
    case Opcode::kWriteAccelerationToRam:
    case Opcode::kOff:
    case Opcode::kStop:
    case Opcode::kRun:
    case Opcode::kWriteOffsetToRom:
    case Opcode::kClearAngle:
    case Opcode::kWriteParameter:
      return Echo{data};
    case Opcode::kReadParameter:
      return ParameterValue{get_parameter(data)};
  }
  assert(false && "an opcode comes from the table");
  return Echo{data};
}

}  // namespace

Frame encode_reply(int id, const Reply& reply, const WireFormat& format) {
  assert(id >= kMinId && id <= kMaxId);
  Frame frame;
  frame.id = format.dialect.reply_id_base + static_cast<std::uint32_t>(id);
  std::visit(ReplyWriter{frame.data, format}, reply);
  return frame;
}

std::variant<ReplyFrame, Reject> decode_reply(const Frame& frame, const WireFormat& format) {
  // Where replies have identifiers of their own, they pass the same checks as queries would.
  Frame as_query = frame;
  as_query.id = frame.id - format.dialect.reply_id_base + kSingleDriveId;
  const auto addressed = address(as_query);
  if (const auto* reject = std::get_if<Reject>(&addressed)) {
    return *reject;
  }
  const int id = std::get<int>(addressed);
  if (id == kMultiDrive) {
    return Reject::kForeignId;  // no drive answers there
  }
  const OpcodeRow* row = find_opcode(frame.data[0]);
  if (row == nullptr || !answers(format, row->opcode)) {
    return Reject::kUnknownCommand;
  }
  if (row->opcode == Opcode::kReadParameter && !known_parameter(frame.data[1])) {
    return Reject::kUnknownCommand;
  }
  return ReplyFrame{id, read_reply(row->opcode, frame.data, format)};
}

}  // namespace lk::protocol
