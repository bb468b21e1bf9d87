// Reads a host's query from named values, in the units and payload layout of the drive.

#include <algorithm>
#include <cmath>

#include "emulator/config/events/config_directives.hpp"
#include "emulator/config/scenario/config_send.hpp"
#include "protocol/codec.hpp"
#include "protocol/field_values.hpp"

namespace lk::emulator {
namespace {

using WireField = protocol::Field;
using protocol::WireFormat;

/// Reads a named value such as "clockwise", or any number that fits into the field.
std::optional<std::int64_t> read_value(TableReader& reader, const WireField& field) {
  const std::string key(field.input_key());
  const auto width = protocol::width(field.wire);
  if (!reader.is_text(key)) return reader.integer(key, width.min, width.max);
  std::vector<std::string> words;
  for (const protocol::Value& value : field.values) words.emplace_back(value.word);
  const auto place = reader.choice(key, words);
  return place ? std::optional<std::int64_t>(field.values[*place].number) : std::nullopt;
}

/// Reads a value in the field's unit. A current may instead be given as `iq_lsb`, the number on the
/// wire.
std::optional<std::int64_t> read_number(TableReader& reader, const WireField& field,
                                        const WireFormat& format) {
  const std::string key(field.input_key());
  const auto width = protocol::width(field.wire);
  if (field.scale == protocol::Scale::kIqCommand) {
    const std::string as_lsb = key.substr(0, key.rfind('_')) + "_lsb";
    if (const auto raw = reader.integer(as_lsb, width.min, width.max)) {
      if (reader.has(key)) reader.fail(as_lsb, "does not go together with " + key);
      return raw;
    }
  }
  const auto value = reader.number(key, protocol::quantity(field, width.min, format),
                                   protocol::quantity(field, width.max, format));
  return value ? std::optional(protocol::raw_of(field, *value, format)) : std::nullopt;
}

void read_field(TableReader& reader, const WireField& field, const WireFormat& format,
                protocol::Payload& data) {
  const auto raw =
      field.values.empty() ? read_number(reader, field, format) : read_value(reader, field);
  if (!raw && !field.is_optional_in_scenarios) reader.note_missing(std::string(field.input_key()));
  // A field with only one allowed value has it by default.
  const std::int64_t default_value = field.values.size() == 1 ? field.values.front().number : 0;
  protocol::put(field, protocol::taken(field, raw.value_or(default_value), format), data);
}

/// Rejects a field that the query has only for other drives or parameters. Without this check,
/// `finish` would report a misspelt key.
void refuse_what_it_lacks(TableReader& reader, std::span<const WireField> fields,
                          const protocol::Payload& data, const WireFormat& format) {
  for (const WireField& field : fields) {
    const auto is_it = [&](const WireField& other) {
      return other.input_key() == field.input_key() && protocol::present(other, data, format);
    };
    const std::string key(field.input_key());
    if (std::ranges::any_of(fields, is_it) || !reader.has(key)) continue;
    reader.fail(key, (field.parameter >= 0 && field.parameter != data[1]) ||
                             (field.item >= 0 && field.item != data[2])
                         ? "belongs to another parameter"
                         : "this drive has it only with " + std::string(field.when.words));
  }
}

/// Returns the size of `command` in an RS-485 packet: command byte and data.
std::uint8_t size_of(const protocol::CommandInfo& command, const protocol::Payload& data,
                     const protocol::WireFormat& format) {
  if (command.query_len != nullptr) return static_cast<std::uint8_t>(1 + command.query_len(format));
  const protocol::PayloadLength len = protocol::payload_length(command.query, data, format);
  const bool more = std::any_of(data.begin() + 1 + len.min, data.end(),
                                [](std::uint8_t byte) { return byte != 0; });
  return static_cast<std::uint8_t>(1 + (more ? len.max : len.min));
}

}  // namespace

std::optional<std::uint8_t> read_command_or_word(TableReader& reader, const std::string& key) {
  const auto text = reader.is_text(key) ? reader.text(key) : std::nullopt;
  const bool is_number = !text || text->empty() || (text->front() >= '0' && text->front() <= '9');
  if (is_number) return read_command(reader, key);
  std::vector<std::string> words;
  std::vector<std::uint8_t> bytes;
  for (const auto rows : {protocol::commands(), protocol::serial_commands()}) {
    for (const protocol::CommandInfo& command : rows) {
      if (std::ranges::find(words, command.word) != words.end()) continue;
      words.emplace_back(command.word);
      bytes.push_back(static_cast<std::uint8_t>(command.opcode));
    }
  }
  const auto place = reader.choice(key, words);
  return place ? std::optional(bytes[*place]) : std::nullopt;
}

protocol::Frame read_query(TableReader& reader, const ServoConfig& servo) {
  const std::uint8_t byte = reader.required("command", read_command_or_word(reader, "command"));
  const auto format = protocol::wire_format(servo.quirks.dialect, servo.profile.series);
  protocol::Frame frame;
  frame.id = protocol::kSingleDriveId + static_cast<std::uint32_t>(servo.id);
  frame.data[0] = byte;
  const bool serial = format.dialect.framing == protocol::Framing::kSerial;
  if (serial) {
    frame.kind = protocol::FrameKind::kSerial;
    frame.dlc = 1;
  }
  const auto* const command = protocol::command_of(frame);
  if (command == nullptr) return frame;  // an unknown command: the layout of its data is unknown
  for (const WireField& field : command->query) {
    if (protocol::present(field, frame.data, format)) {
      read_field(reader, field, format, frame.data);
    }
  }
  refuse_what_it_lacks(reader, command->query, frame.data, format);
  if (serial) frame.dlc = size_of(*command, frame.data, format);
  return frame;
}

}  // namespace lk::emulator
