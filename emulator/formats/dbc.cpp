#include "emulator/formats/dbc.hpp"

#include <algorithm>
#include <cstdio>
#include <vector>

#include "emulator/formats/fields.hpp"

namespace lk::formats {
namespace {

using protocol::Opcode;
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
  bool multiplexed = true;  // by DATA[0]
};

std::string number(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.15g", value);
  return buffer;
}

/// What `raw` stands for; whole numbers to the last digit.
std::string value(const Field& field, std::int64_t raw) {
  return field.lsb == 1 ? std::to_string(raw) : number(static_cast<double>(raw) * field.lsb);
}

std::string drive(int id) { return "Drive" + std::to_string(id); }

std::string hex(unsigned byte) {
  char buffer[16];
  std::snprintf(buffer, sizeof buffer, "0x%02X", byte);
  return buffer;
}

/// Readers of DBC files take a command without any field for a mistake.
Field unused() {
  return {.name = "unused",
          .label = "Bytes without a meaning: 0, and in the reply as they were in the query",
          .first_bit = 8,
          .bits = 56,
          .raw_max = (std::int64_t{1} << 56U) - 1};
}

Field command_field(const WireFormat& format) {
  return {
      .name = "command", .label = "DATA[0]", .bits = 8, .raw_max = 255, .values = commands(format)};
}

/// What DATA[1..7] can be, each name once.
std::vector<Signal> signals_of(Direction direction, const WireFormat& format) {
  std::vector<Signal> signals;
  for (const Value& command : commands(format)) {
    const auto opcode = static_cast<Opcode>(command.number);
    auto fields = direction == Direction::kQueries ? query_fields(opcode, format)
                                                   : reply_fields(opcode, format);
    if (fields.empty()) fields.push_back(unused());
    for (Field& field : fields) {
      const auto known = std::ranges::find_if(
          signals, [&field](const Signal& one) { return one.field.name == field.name; });
      if (known == signals.end()) {
        signals.push_back({std::move(field), {command.number}});
      } else {
        known->commands.push_back(command.number);
      }
    }
  }
  return signals;
}

std::string bits_and_scale(const Field& field, const std::string& receivers) {
  return " : " + std::to_string(field.first_bit) + "|" + std::to_string(field.bits) + "@1" +
         (field.is_signed ? "-" : "+") + " (" + number(field.lsb) + ",0) [" +
         value(field, field.raw_min) + "|" + value(field, field.raw_max) + "] \"" +
         std::string(field.unit) + "\" " + receivers + "\n";
}

/// How a signal is multiplexed, as far as one number can say it: SG_MUL_VAL_ has the rest.
std::string multiplexing(const Signal& signal) {
  if (signal.field.parameter >= 0) return " m" + std::to_string(signal.field.parameter);
  const bool parameter = signal.field.name == "parameter";
  return " m" + std::to_string(signal.commands.front()) + (parameter ? "M" : "");
}

/// "154-154, 160-168".
std::string ranges(const std::vector<unsigned>& commands) {
  std::string text;
  for (std::size_t n = 0; n < commands.size();) {
    std::size_t last = n;
    while (last + 1 < commands.size() && commands[last + 1] == commands[last] + 1) ++last;
    text += (text.empty() ? "" : ", ") + std::to_string(commands[n]) + "-" +
            std::to_string(commands[last]);
    n = last + 1;
  }
  return text;
}

std::string values_line(const Message& message, const Field& field) {
  if (field.values.empty()) return "";
  std::string text = "VAL_ " + std::to_string(message.id) + " " + std::string(field.name);
  for (const Value& value : field.values) {
    text += " " + std::to_string(value.number) + " \"" + std::string(value.word) + "\"";
  }
  return text + " ;\n";
}

std::string source_words(protocol::Source source) {
  switch (source) {
    case protocol::Source::kManual:
      return "the vendor's CAN manual";
    case protocol::Source::kManualAndHardware:
      return "the manual, and seen on drives";
    case protocol::Source::kHardware:
      return "seen on drives, the manual prints another byte";
    case protocol::Source::kNewerManuals:
      return "the manuals V2.35 and V2.36";
  }
  return "";
}

/// The parts of a file in the order in which they stand there.
class File {
 public:
  File(Direction direction, std::string_view generation, const WireFormat& format)
      : direction_(direction), generation_(generation), format_(format) {}

  std::string text() {
    const auto signals = signals_of(direction_, format_);
    for (int id = protocol::kMinId; id <= protocol::kMaxId; ++id) add_drive(id, signals);
    for (const auto& row : protocol::kMultiDriveRows) {
      if (knows_multi_drive(format_, row.id)) add_several(row);
    }
    return head() + messages_ + comment() + comments_ + values_ + multiplexing_;
  }

 private:
  bool queries() const { return direction_ == Direction::kQueries; }

  void add(const Message& message, const std::vector<Signal>& signals) {
    const std::string id = std::to_string(message.id);
    messages_ += "BO_ " + id + " " + message.name + ": 8 " + message.sender + "\n";
    comments_ += "CM_ BO_ " + id + " \"" + message.comment + "\";\n";
    if (message.multiplexed) {
      const Field command = command_field(format_);
      messages_ += " SG_ command M" + bits_and_scale(command, message.receivers);
      values_ += values_line(message, command);
    }
    for (const Signal& signal : signals) {
      const std::string name(signal.field.name);
      messages_ += " SG_ " + name + (message.multiplexed ? multiplexing(signal) : "") +
                   bits_and_scale(signal.field, message.receivers);
      comments_ += "CM_ SG_ " + id + " " + name + " \"" + std::string(signal.field.label) + "\";\n";
      values_ += values_line(message, signal.field);
      if (!message.multiplexed) continue;
      const std::string under =
          signal.field.parameter < 0
              ? "command " + ranges(signal.commands)
              : "parameter " + ranges({static_cast<unsigned>(signal.field.parameter)});
      multiplexing_ += "SG_MUL_VAL_ " + id + " " + name + " " + under + ";\n";
    }
    messages_ += "\n";
  }

  void add_drive(int id, const std::vector<Signal>& signals) {
    const std::uint32_t base = queries() ? protocol::kSingleDriveId : format_.dialect.reply_id_base;
    add({.id = base + static_cast<std::uint32_t>(id),
         .name = drive(id) + (queries() ? "_Query" : "_Reply"),
         .sender = queries() ? "Host" : drive(id),
         .receivers = queries() ? drive(id) : "Host",
         .comment = (queries() ? "Queries to drive " : "Replies of drive ") + std::to_string(id)},
        signals);
  }

  void add_several(const protocol::MultiDriveRow& row) {
    std::vector<Signal> signals;
    for (Field& field : multi_drive_fields(row.id, format_)) {
      signals.push_back({std::move(field), {}});
    }
    add({.id = row.id,
         .name = "Several_" + hex(row.id).substr(2) + "_Query",
         .sender = "Host",
         .receivers = "Drive1,Drive2,Drive3,Drive4",
         .comment = std::string(row.name) + " of the drives 1 to 4 in multi-drive mode; source: " +
                    source_words(row.source),
         .multiplexed = false},
        signals);
  }

  std::string head() const {
    std::string nodes = "BU_: Host";
    for (int id = protocol::kMinId; id <= protocol::kMaxId; ++id) nodes += " " + drive(id);
    return "VERSION \"\"\n\nNS_ :\n\tCM_\n\tVAL_\n\tSG_MUL_VAL_\n\nBS_:\n\n" + nodes + "\n\n";
  }

  std::string comment() const {
    const bool ms = format_.series == protocol::Series::kMs;
    std::string text =
        "CM_ \"LK-TECH motors of the generation " + std::string(generation_) + ": " +
        (queries() ? "queries" : "replies") +
        ". A query and its reply share identifier and DATA[0], and a DBC file can mean only one "
        "of them: the other one decodes as nonsense here, for it there is a file of its own. "
        "Current: one LSB of iq is " +
        number(queries() ? format_.iq_command_lsb_A : format_.iq_reply_lsb_A) + " A";
    if (format_.dialect.iq_scale == protocol::CurrentScale::kSeries) {
      text += ", that of the series MF and MH; on MG it is twice that, as are limits in A";
    }
    if (!ms) text += "; MS drives have the share of the largest voltage in its place, 0.1 %";
    text +=
        ". Written by lk-emu-formats of lk-emu, docs/tools.md; the bytes are in docs/protocol.md. "
        "Where the commands come from:";
    for (const auto& row : protocol::kOpcodes) {
      if (!answers(format_, row.opcode)) continue;
      text += "\n" + hex(static_cast<unsigned>(row.opcode)) + " " + std::string(row.name) + ": " +
              source_words(row.source);
    }
    return text + "\";\n";
  }

  Direction direction_;
  std::string_view generation_;
  WireFormat format_;
  std::string messages_, comments_, values_, multiplexing_;
};

}  // namespace

std::string dbc(Direction direction, std::string_view generation, const WireFormat& format) {
  return File(direction, generation, format).text();
}

}  // namespace lk::formats
