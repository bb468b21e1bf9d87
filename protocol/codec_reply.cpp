#include <cassert>

#include "protocol/codec.hpp"
#include "protocol/wire.hpp"

namespace lk::protocol {
namespace {

void put_temperature_C(Payload& data, double temperature_C) {
  put_le(data, 1, quantize<std::int8_t>(temperature_C, 1.0));
}

double get_temperature_C(const Payload& data) { return get_le<std::int8_t>(data, 1); }

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
    put_le(data, 6, reply.angle_cdeg);
  }
  void operator()(const State1& reply) const {
    start(reply.command);
    put_temperature_C(data, reply.temperature_C);
    put_le(data, 3, quantize<std::uint16_t>(reply.voltage_V, format.voltage_lsb_V));
    data[7] = reply.errors;
  }
  void operator()(const State2& reply) const {
    const auto limit = format.iq_reply_limit_lsb;
    start(reply.command);
    put_temperature_C(data, reply.temperature_C);
    put_le(data, 2,
           quantize<std::int16_t>(reply.iq_A, format.iq_reply_lsb_A,
                                  static_cast<std::int16_t>(-limit), limit));
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
};

State1 read_state_1(Opcode command, const Payload& data, const WireFormat& format) {
  return {.command = command,
          .temperature_C = get_temperature_C(data),
          .voltage_V = get_le<std::uint16_t>(data, 3) * format.voltage_lsb_V,
          .errors = data[7]};
}

State2 read_state_2(Opcode command, const Payload& data, const WireFormat& format) {
  return {.command = command,
          .temperature_C = get_temperature_C(data),
          .iq_A = get_le<std::int16_t>(data, 2) * format.iq_reply_lsb_A,
          .speed_dps = static_cast<double>(get_le<std::int16_t>(data, 4)),
          .encoder_counts = get_le<std::uint16_t>(data, 6)};
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
    case Opcode::kReadEncoder:
      return Encoder{get_le<std::uint16_t>(data, 2), get_le<std::uint16_t>(data, 4),
                     get_le<std::uint16_t>(data, 6)};
    case Opcode::kReadMultiTurnAngle:
      return MultiTurnAngle{get_le56(data)};
    case Opcode::kReadSingleTurnAngle:
      return SingleTurnAngle{get_le<std::uint16_t>(data, 6)};
    case Opcode::kReadState1:
    case Opcode::kClearErrors:
      return read_state_1(opcode, data, format);
    case Opcode::kReadState2:
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
      return Echo{data};
  }
  assert(false && "an opcode comes from the table");
  return Echo{data};
}

}  // namespace

Frame encode_reply(int id, const Reply& reply, const WireFormat& format) {
  assert(id >= kMinId && id <= kMaxId);
  Frame frame;
  frame.id = kSingleDriveId + static_cast<std::uint32_t>(id);
  std::visit(ReplyWriter{frame.data, format}, reply);
  return frame;
}

std::variant<ReplyFrame, Reject> decode_reply(const Frame& frame, const WireFormat& format) {
  const auto addressed = address(frame);
  if (const auto* reject = std::get_if<Reject>(&addressed)) {
    return *reject;
  }
  const int id = std::get<int>(addressed);
  if (id == kMultiDrive) {
    return Reject::kForeignId;  // no drive answers there
  }
  const OpcodeRow* row = find_opcode(frame.data[0]);
  if (row == nullptr) {
    return Reject::kUnknownCommand;
  }
  return ReplyFrame{id, read_reply(row->opcode, frame.data, format)};
}

}  // namespace lk::protocol
