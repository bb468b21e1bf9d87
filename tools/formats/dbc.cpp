#include "tools/formats/dbc.hpp"

#include <algorithm>
#include <cstdio>
#include <sstream>
#include <vector>

#include "tools/formats/fields.hpp"

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
  bool multiplexed = true;  // by DATA[0]
};

std::string number(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.15g", value);
  return buffer;
}

/// Returns the value of `raw`; whole numbers are exact.
std::string value(const Field& field, std::int64_t raw) {
  return field.lsb == 1 ? std::to_string(raw) : number(static_cast<double>(raw) * field.lsb);
}

std::string drive(int id) {
  std::string name = "Drive";
  return name += std::to_string(id);
}

std::string hex(unsigned byte) {
  char buffer[16];
  std::snprintf(buffer, sizeof buffer, "0x%02X", byte);
  return buffer;
}

Field command_field(const WireFormat& format) {
  return {.name = "command",
          .label = "DATA[0]",
          .bits = 8,
          .raw_max = 255,
          .values = command_values(format)};
}

/// Returns the signals in DATA[1..7], each name once.
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

void put_bits_and_scale(std::ostream& out, const Field& field, const std::string& receivers) {
  out << " : " << field.first_bit << "|" << field.bits << "@1" << (field.is_signed ? "-" : "+")
      << " (" << number(field.lsb) << ",0) [" << value(field, field.raw_min) << "|"
      << value(field, field.raw_max) << "] \"" << field.unit.ascii << "\" " << receivers << "\n";
}

/// Writes the multiplexer value of a signal. Only one fits here: SG_MUL_VAL_ has the rest.
void put_multiplexing(std::ostream& out, const Signal& signal) {
  const Field& field = signal.field;
  out << " m" << (field.selector.empty() ? signal.commands.front() : field.only_at)
      << (field.selects ? "M" : "");
}

/// Writes " 156-156, 161-161, 162-162": no ranges, because some readers do not know them.
void put_each(std::ostream& out, const std::vector<unsigned>& numbers) {
  for (std::size_t n = 0; n < numbers.size(); ++n) {
    out << (n == 0 ? " " : ", ") << numbers[n] << "-" << numbers[n];
  }
}

void put_values(std::ostream& out, std::uint32_t id, const Field& field) {
  if (field.values.empty()) return;
  out << "VAL_ " << id << " " << field.name;
  for (const Value& value : field.values) out << " " << value.number << " \"" << value.word << "\"";
  out << " ;\n";
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

/// The sections of a DBC file, in their order.
class File {
 public:
  File(Direction direction, std::string_view generation, const WireFormat& format)
      : queries_(direction == Direction::kQueries), generation_(generation), format_(format) {
    const auto signals = signals_of(direction, format);
    for (int id = protocol::kMinId; id <= protocol::kMaxId; ++id) add_drive(id, signals);
    for (const auto& row : protocol::multi_drive_commands()) {
      if (protocol::knows(format, row)) add_several(row);
    }
  }

  std::string text() const {
    std::ostringstream out;
    out << "VERSION \"\"\n\nNS_ :\n\tCM_\n\tVAL_\n\tSG_MUL_VAL_\n\nBS_:\n\nBU_: Host";
    for (int id = protocol::kMinId; id <= protocol::kMaxId; ++id) out << " " << drive(id);
    out << "\n\n" << messages_.str();
    put_comment(out);
    out << comments_.str() << values_.str() << multiplexing_.str();
    return out.str();
  }

 private:
  void add(const Message& message, const std::vector<Signal>& signals) {
    messages_ << "BO_ " << message.id << " " << message.name << ": 8 " << message.sender << "\n";
    comments_ << "CM_ BO_ " << message.id << " \"" << message.comment << "\";\n";
    if (message.multiplexed) {
      const Field command = command_field(format_);
      messages_ << " SG_ command M";
      put_bits_and_scale(messages_, command, message.receivers);
      put_values(values_, message.id, command);
    }
    for (const Signal& signal : signals) add_signal(message, signal);
    messages_ << "\n";
  }

  void add_signal(const Message& message, const Signal& signal) {
    const Field& field = signal.field;
    messages_ << " SG_ " << field.name;
    if (message.multiplexed) put_multiplexing(messages_, signal);
    put_bits_and_scale(messages_, field, message.receivers);
    comments_ << "CM_ SG_ " << message.id << " " << field.name << " \"" << field.label << "\";\n";
    put_values(values_, message.id, field);
    if (!message.multiplexed) return;
    multiplexing_ << "SG_MUL_VAL_ " << message.id << " " << field.name << " "
                  << (field.selector.empty() ? "command" : field.selector);
    put_each(multiplexing_, field.selector.empty() ? signal.commands : std::vector{field.only_at});
    multiplexing_ << ";\n";
  }

  void add_drive(int id, const std::vector<Signal>& signals) {
    const std::uint32_t base = queries_ ? protocol::kSingleDriveId : format_.dialect.reply_id_base;
    add({.id = base + static_cast<std::uint32_t>(id),
         .name = drive(id).append(queries_ ? "_Query" : "_Reply"),
         .sender = queries_ ? "Host" : drive(id),
         .receivers = queries_ ? drive(id) : "Host",
         .comment = (queries_ ? "Queries to " : "Replies of ") + drive(id)},
        signals);
  }

  void add_several(const protocol::CommandInfo& row) {
    std::vector<Signal> signals;
    for (Field& field : multi_drive_fields(row, format_)) {
      signals.push_back({std::move(field), {}});
    }
    std::ostringstream name;
    std::ostringstream comment;
    name << "Several_" << std::hex << row.identifier << "_Query";
    comment << row.name
            << " of the drives 1 to 4 in multi-drive mode; source: " << source_words(row.source);
    add({.id = row.identifier,
         .name = name.str(),
         .sender = "Host",
         .receivers = "Drive1,Drive2,Drive3,Drive4",
         .comment = comment.str(),
         .multiplexed = false},
        signals);
  }

  void put_comment(std::ostream& out) const {
    out << "CM_ \"LK-TECH motors of the generation " << generation_ << ": "
        << (queries_ ? "queries" : "replies")
        << ". A query and its reply share identifier and DATA[0], and a DBC file can mean only one "
           "of them: the other one decodes as nonsense here, for it there is a file of its own. "
           "One LSB of iq is "
        << number(queries_ ? format_.iq_command_lsb_A : format_.iq_reply_lsb_A) << " A";
    if (format_.dialect.iq_scale == protocol::CurrentScale::kSeries) {
      out << ", that of the series MF and MH; on MG it is twice that";
    }
    if (!queries_) {
      if (format_.dialect.phase_current_scale == protocol::CurrentScale::kSeries) {
        out << ", and so is one of the phase currents";
      }
      out << "; MS drives have power in the place of iq, one LSB is 0.1 % of the largest voltage";
    }
    out << ". Written by lk-emu-formats of lk-emu; docs/reference/formats.md tells how to use it, "
           "docs/reference/protocol.md has the bytes. Where the commands come from:";
    for (const auto& row : protocol::commands()) {
      if (!protocol::knows(format_, row)) continue;
      out << "\n"
          << hex(static_cast<unsigned>(row.opcode)) << " " << row.name << ": "
          << source_words(row.source);
    }
    out << "\";\n";
  }

  bool queries_;
  std::string_view generation_;
  WireFormat format_;
  std::ostringstream messages_, comments_, values_, multiplexing_;
};

}  // namespace

std::string dbc(Direction direction, std::string_view generation, const WireFormat& format) {
  return File(direction, generation, format).text();
}

}  // namespace lk::formats
