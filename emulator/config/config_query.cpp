// A host's query in words, in the drive's own units and layout.

#include <algorithm>
#include <cmath>

#include "emulator/config/config_directives.hpp"
#include "emulator/config/config_send.hpp"
#include "protocol/codec.hpp"

namespace lk::emulator {
namespace {

using protocol::Command;
using protocol::Opcode;

struct Context {
  TableReader& reader;
  const protocol::WireFormat& format;
};

template <class Kind>
Command plain(const Context&) {
  return Kind{};
}

double needed(TableReader& reader, const char* key, double min, double max) {
  const auto value = reader.number(key, min, max);
  if (!value) reader.note_missing(key);
  return value.value_or(0);
}

template <class Integer>
Integer cdeg(TableReader& reader, const char* key) {
  constexpr double kMin = std::numeric_limits<Integer>::min() / 100.0;
  constexpr double kMax = std::numeric_limits<Integer>::max() / 100.0;
  return static_cast<Integer>(std::llround(needed(reader, key, kMin, kMax) * 100));
}

std::uint16_t max_speed_dps(TableReader& reader) {
  const auto speed = reader.integer("max_speed_dps", 0, UINT16_MAX);
  if (!speed) reader.note_missing("max_speed_dps");
  return static_cast<std::uint16_t>(speed.value_or(0));
}

std::uint8_t direction(TableReader& reader) {
  const auto word = reader.choice("direction", {"clockwise", "counterclockwise"});
  if (!word) reader.note_missing("direction");
  return static_cast<std::uint8_t>(word.value_or(0));
}

Command torque(const Context& context) {
  TableReader& reader = context.reader;
  const auto lsb = reader.integer("iq_lsb", INT16_MIN, INT16_MAX);
  if (lsb && reader.has("iq_A")) reader.fail("iq_lsb", "does not go together with iq_A");
  if (lsb) return protocol::Torque{static_cast<double>(*lsb) * context.format.iq_command_lsb_A};
  return protocol::Torque{needed(reader, "iq_A", -100, 100)};
}

Command speed(const Context& context) {
  protocol::Speed command{needed(context.reader, "speed_dps", -2e7, 2e7), 0};
  if (const auto limit = context.reader.number("iq_limit_A", 0, 100)) {
    if (!context.format.dialect.speed_iq_limit) {
      context.reader.fail("iq_limit_A", "this drive's 0xA2 has no limit of iq (v236 has)");
    }
    command.iq_limit_A = *limit;
  }
  return command;
}

Command open_loop(const Context& context) {
  constexpr double kLimit = protocol::kOpenLoopLimit_permille;
  return protocol::OpenLoop{static_cast<std::int16_t>(
      std::llround(needed(context.reader, "power_permille", -kLimit, kLimit)))};
}

Command position_1(const Context& context) {
  return protocol::Position1{cdeg<std::int32_t>(context.reader, "angle_deg")};
}
Command position_2(const Context& context) {
  const std::uint16_t limit = max_speed_dps(context.reader);
  return protocol::Position2{limit, cdeg<std::int32_t>(context.reader, "angle_deg")};
}
Command position_3(const Context& context) {
  const std::uint8_t way = direction(context.reader);
  return protocol::Position3{way, cdeg<std::uint32_t>(context.reader, "angle_deg")};
}
Command position_4(const Context& context) {
  const std::uint8_t way = direction(context.reader);
  const std::uint16_t limit = max_speed_dps(context.reader);
  return protocol::Position4{way, limit, cdeg<std::uint32_t>(context.reader, "angle_deg")};
}
Command position_5(const Context& context) {
  return protocol::Position5{cdeg<std::int32_t>(context.reader, "turn_deg")};
}
Command position_6(const Context& context) {
  const std::uint16_t limit = max_speed_dps(context.reader);
  return protocol::Position6{limit, cdeg<std::int32_t>(context.reader, "turn_deg")};
}

Command acceleration(const Context& context) {
  return protocol::WriteAccelerationToRam{static_cast<std::int32_t>(
      std::llround(needed(context.reader, "acceleration_dps_s", 0, INT32_MAX)))};
}
Command offset(const Context& context) {
  return protocol::WriteOffsetToRom{
      static_cast<std::uint16_t>(needed(context.reader, "offset", 0, UINT16_MAX))};
}
Command clear_angle(const Context& context) {
  const bool sets = context.format.dialect.clear_angle == protocol::ClearAngleMeaning::kSetsAngle;
  return sets ? protocol::ClearAngle{cdeg<std::int32_t>(context.reader, "angle_deg")}
              : protocol::ClearAngle{};
}
Command brake(const Context& context) {
  const auto word = context.reader.choice("brake", {"engage", "release", "read"});
  if (!word) context.reader.note_missing("brake");
  constexpr std::uint8_t kBrakeActions[] = {protocol::kBrakeEngage, protocol::kBrakeRelease,
                                            protocol::kBrakeRead};
  return protocol::Brake{kBrakeActions[word.value_or(0)]};
}

struct Word {
  const char* word;
  Opcode opcode;
  Command (*read)(const Context& context);
};
constexpr Word kWords[] = {
    {"off", Opcode::kOff, plain<protocol::Off>},
    {"stop", Opcode::kStop, plain<protocol::Stop>},
    {"run", Opcode::kRun, plain<protocol::Run>},
    {"brake", Opcode::kBrake, brake},
    {"clear_errors", Opcode::kClearErrors, plain<protocol::ClearErrors>},
    {"state_1", Opcode::kReadState1, plain<protocol::ReadState1>},
    {"state_2", Opcode::kReadState2, plain<protocol::ReadState2>},
    {"state_3", Opcode::kReadState3, plain<protocol::ReadState3>},
    {"multi_turn_angle", Opcode::kReadMultiTurnAngle, plain<protocol::ReadMultiTurnAngle>},
    {"single_turn_angle", Opcode::kReadSingleTurnAngle, plain<protocol::ReadSingleTurnAngle>},
    {"encoder", Opcode::kReadEncoder, plain<protocol::ReadEncoder>},
    {"pid", Opcode::kReadPid, plain<protocol::ReadPid>},
    {"acceleration", Opcode::kReadAcceleration, plain<protocol::ReadAcceleration>},
    {"write_acceleration", Opcode::kWriteAccelerationToRam, acceleration},
    {"write_offset", Opcode::kWriteOffsetToRom, offset},
    {"write_zero", Opcode::kWriteZeroToRom, plain<protocol::WriteZeroToRom>},
    {"clear_angle", Opcode::kClearAngle, clear_angle},
    {"open_loop", Opcode::kOpenLoop, open_loop},
    {"torque", Opcode::kTorque, torque},
    {"speed", Opcode::kSpeed, speed},
    {"position_1", Opcode::kPosition1, position_1},
    {"position_2", Opcode::kPosition2, position_2},
    {"position_3", Opcode::kPosition3, position_3},
    {"position_4", Opcode::kPosition4, position_4},
    {"position_5", Opcode::kPosition5, position_5},
    {"position_6", Opcode::kPosition6, position_6},
};

}  // namespace

std::optional<std::uint8_t> read_command_or_word(TableReader& reader, const std::string& key) {
  const auto text = reader.is_text(key) ? reader.text(key) : std::nullopt;
  const bool is_number = !text || text->empty() || (text->front() >= '0' && text->front() <= '9');
  if (is_number) return read_command(reader, key);
  std::vector<std::string> words;
  for (const Word& word : kWords) words.emplace_back(word.word);
  const auto place = reader.choice(key, words);
  return place ? std::optional(static_cast<std::uint8_t>(kWords[*place].opcode)) : std::nullopt;
}

protocol::Frame read_query(TableReader& reader, const ServoConfig& servo) {
  const auto byte = read_command_or_word(reader, "command");
  if (!byte) reader.note_missing("command");
  const auto format = protocol::wire_format(servo.quirks.dialect, servo.profile.series);
  const auto word = std::ranges::find(kWords, static_cast<Opcode>(byte.value_or(0)), &Word::opcode);
  if (word != std::end(kWords)) {
    return protocol::encode_query(servo.id, word->read({reader, format}), format);
  }
  // A byte without a word of its own: nothing behind it.
  protocol::Frame frame;
  frame.id = protocol::kSingleDriveId + static_cast<std::uint32_t>(servo.id);
  frame.data[0] = byte.value_or(0);
  return frame;
}

}  // namespace lk::emulator
