#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "tools/formats/fields.hpp"
#include "tools/formats/formats.hpp"

namespace lk::formats {
namespace {

using protocol::WireFormat;

/// A field and the commands whose frames have it.
struct Signal {
  Field field;
  std::vector<unsigned> commands;  // ascending
};

struct Message {
  std::uint32_t id = 0;
  std::string name;
  std::string sender;
  std::string receivers;
  std::string comment;
  bool multiplexed = true;  // true: DATA[0] selects the signals
};

std::string number(double value) { return fmt::format("{:.15g}", value); }

/// Returns the text of the value of `raw`; exact for whole numbers.
std::string value(const Field& field, std::int64_t raw) {
  return field.lsb == 1 ? std::to_string(raw) : number(static_cast<double>(raw) * field.lsb);
}

std::string drive(int id) { return fmt::format("Drive{}", id); }

Field command_field(const WireFormat& format) {
  return {.name = "command",
          .label = "DATA[0]",
          .bits = 8,
          .raw_max = 255,
          .values = command_values(format)};
}

/// Returns the signals in DATA[1..7], one for each name.
std::vector<Signal> signals_of(Direction direction, const WireFormat& format) {
  std::vector<Signal> signals;
  for (const auto& command : protocol::commands()) {
    if (!protocol::knows(format, command)) continue;
    const auto byte = static_cast<unsigned>(command.opcode);
    for (Field& field :
         fields_of(direction == Direction::kQueries ? command.query : command.reply, format)) {
      const auto known = std::ranges::find_if(
          signals, [&field](const Signal& one) { return one.field.name == field.name; });
      if (known == signals.end()) {
        signals.push_back({std::move(field), {byte}});
      } else {
        known->commands.push_back(byte);
      }
    }
  }
  return signals;
}

/// Returns the bits, scale, range, unit and receivers of a signal.
std::string scale_text(const Field& field, const std::string& receivers) {
  return fmt::format(" : {}|{}@1{} ({},0) [{}|{}] \"{}\" {}\n", field.first_bit, field.bits,
                     field.is_signed ? "-" : "+", number(field.lsb), value(field, field.raw_min),
                     value(field, field.raw_max), field.unit.ascii, receivers);
}

/// Returns a multiplexer value of a signal, as " m156". SG_ has room for one; SG_MUL_VAL_ has all.
std::string multiplexing(const Signal& signal) {
  const Field& field = signal.field;
  return fmt::format(" m{}{}", field.selector.empty() ? signal.commands.front() : field.only_at,
                     field.selects ? "M" : "");
}

/// Returns "156-156, 161-161, 162-162": a range for each number, as some programs read no others.
std::string each(const std::vector<unsigned>& numbers) {
  std::string text;
  for (const unsigned one : numbers)
    text += fmt::format("{}{}-{}", text.empty() ? "" : ", ", one, one);
  return text;
}

std::string values_text(std::uint32_t id, const Field& field) {
  if (field.values.empty()) return "";
  std::string text = fmt::format("VAL_ {} {}", id, field.name);
  for (const Value& value : field.values)
    text += fmt::format(" {} \"{}\"", value.number, value.word);
  return text + " ;\n";
}

std::string_view source_words(protocol::Source source) {
  switch (source) {
    case protocol::Source::kManual:
      return "the vendor's CAN manual";
    case protocol::Source::kManualAndHardware:
      return "the manual, and seen on drives";
    case protocol::Source::kHardware:
      return "seen on drives, the manual prints another byte";
    case protocol::Source::kNewerManuals:
      return "the manuals V2.35 and V2.36";
    case protocol::Source::kSecondPrint:
      return "the second print of the manual V2.36";
    case protocol::Source::kTool:
      return "the vendor's PC tool";  // not on CAN
  }
  return "";
}

/// The sections of a DBC file that describe messages.
struct Sections {
  std::string messages, comments, values, multiplexing;
};

void add_signal(Sections& out, const Message& message, const Signal& signal) {
  const Field& field = signal.field;
  out.messages +=
      fmt::format(" SG_ {}{}{}", field.name, message.multiplexed ? multiplexing(signal) : "",
                  scale_text(field, message.receivers));
  out.comments += fmt::format("CM_ SG_ {} {} \"{}\";\n", message.id, field.name, field.label);
  out.values += values_text(message.id, field);
  if (!message.multiplexed) return;
  out.multiplexing +=
      fmt::format("SG_MUL_VAL_ {} {} {} {};\n", message.id, field.name,
                  field.selector.empty() ? "command" : field.selector,
                  each(field.selector.empty() ? signal.commands : std::vector{field.only_at}));
}

void add(Sections& out, const Message& message, const std::vector<Signal>& signals,
         const WireFormat& format) {
  out.messages += fmt::format("BO_ {} {}: 8 {}\n", message.id, message.name, message.sender);
  out.comments += fmt::format("CM_ BO_ {} \"{}\";\n", message.id, message.comment);
  if (message.multiplexed) {
    const Field command = command_field(format);
    out.messages += " SG_ command M" + scale_text(command, message.receivers);
    out.values += values_text(message.id, command);
  }
  for (const Signal& signal : signals) add_signal(out, message, signal);
  out.messages += "\n";
}

Message drive_message(int id, Direction direction, const WireFormat& format) {
  const bool queries = direction == Direction::kQueries;
  const std::uint32_t base = queries ? protocol::kSingleDriveId : format.dialect.reply_id_base;
  return {.id = base + static_cast<std::uint32_t>(id),
          .name = drive(id) + (queries ? "_Query" : "_Reply"),
          .sender = queries ? "Host" : drive(id),
          .receivers = queries ? drive(id) : "Host",
          .comment = (queries ? "Queries to " : "Replies of ") + drive(id)};
}

Message multi_drive_message(const protocol::CommandInfo& row) {
  return {.id = row.identifier,
          .name = fmt::format("Several_{:x}_Query", row.identifier),
          .sender = "Host",
          .receivers = "Drive1,Drive2,Drive3,Drive4",
          .comment = fmt::format("{} of the drives 1 to 4 in multi-drive mode; source: {}",
                                 row.name, source_words(row.source)),
          .multiplexed = false};
}

std::string file_comment(Direction direction, std::string_view generation,
                         const WireFormat& format) {
  const bool queries = direction == Direction::kQueries;
  std::string text = fmt::format(
      "CM_ \"LK-TECH motors of the generation {}: {}. A query and its reply share identifier and "
      "DATA[0], and a DBC file can mean only one of them: the other one decodes as nonsense here, "
      "for it there is a file of its own. One LSB of iq is {} A",
      generation, queries ? "queries" : "replies",
      number(queries ? format.iq_command_lsb_A : format.iq_reply_lsb_A));
  if (format.dialect.iq_scale == protocol::CurrentScale::kSeries) {
    text += ", that of the series MF and MH; on MG it is twice that";
  }
  if (!queries) {
    if (format.dialect.phase_current_scale == protocol::CurrentScale::kSeries) {
      text += ", and so is one of the phase currents";
    }
    text += "; MS drives have power in the place of iq, one LSB is 0.1 % of the largest voltage";
  }
  text +=
      ". Written by lk-emu-formats of lk-emu; docs/reference/formats.md tells how to use it, "
      "docs/reference/protocol.md has the bytes. Where the commands come from:";
  for (const auto& row : protocol::commands()) {
    if (!protocol::knows(format, row)) continue;
    text += fmt::format("\n0x{:02X} {}: {}", static_cast<unsigned>(row.opcode), row.name,
                        source_words(row.source));
  }
  return text + "\";\n";
}

}  // namespace

std::string dbc(Direction direction, std::string_view generation, const WireFormat& format) {
  Sections sections;
  std::string drives;
  const auto signals = signals_of(direction, format);
  for (int id = protocol::kMinId; id <= protocol::kMaxId; ++id) {
    drives += " " + drive(id);
    add(sections, drive_message(id, direction, format), signals, format);
  }
  for (const auto& row : protocol::multi_drive_commands()) {
    if (!protocol::knows(format, row)) continue;
    std::vector<Signal> slots;
    for (Field& field : multi_drive_fields(row, format)) slots.push_back({std::move(field), {}});
    add(sections, multi_drive_message(row), slots, format);
  }
  return "VERSION \"\"\n\nNS_ :\n\tCM_\n\tVAL_\n\tSG_MUL_VAL_\n\nBS_:\n\nBU_: Host" + drives +
         "\n\n" + sections.messages + file_comment(direction, generation, format) +
         sections.comments + sections.values + sections.multiplexing;
}

}  // namespace lk::formats
