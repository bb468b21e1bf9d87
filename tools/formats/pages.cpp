#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/command_info.hpp"
#include "protocol/wire_format.hpp"
#include "tools/formats/formats.hpp"

namespace lk::formats {
namespace {

using protocol::CommandInfo;
using protocol::Framing;
using protocol::Series;
using WireField = protocol::Field;

std::string hex_text(unsigned number) { return fmt::format("0x{:02X}", number); }

std::string hex_text(protocol::Opcode opcode) { return hex_text(static_cast<unsigned>(opcode)); }

/// Returns the bytes of a field: "`[4:7]`" or "`[1]`". Byte `first` of DATA counts as 0.
std::string place_text(const WireField& field, int first = 0, std::string_view name = "") {
  const int from = field.byte - first;
  const int last = from + protocol::bytes_of(field.wire) - 1;
  return last > from ? fmt::format("`{}[{}:{}]`", name, from, last)
                     : fmt::format("`{}[{}]`", name, from);
}

/// Returns the condition of a field in brackets, after a space; empty without a condition.
std::string when_text(const WireField& field) {
  return field.when.words.empty() ? "" : fmt::format(" ({})", field.when.words);
}

std::string_view type_text(protocol::Wire wire) {
  constexpr std::string_view kTypes[] = {"uint8", "int8",          "uint16", "int16", "uint32",
                                         "int32", "signed 56 bit", "uint24", "int64"};
  return kTypes[static_cast<std::size_t>(wire)];
}

/// Returns the bytes that select a field, like "0x0A" or "0x05 0xE2"; empty if none do.
std::string only_with(const WireField& field) {
  if (field.parameter < 0) return "";
  std::string text = hex_text(static_cast<unsigned>(field.parameter));
  if (field.item >= 0) text += " " + hex_text(static_cast<unsigned>(field.item));
  return text;
}

std::string fields_text(std::span<const WireField> fields) {
  std::string text;
  std::string before;
  for (const WireField& field : fields) {
    const std::string with = only_with(field);
    if (!text.empty()) text += with != before ? "; " : ", ";
    if (with != before) text += with + ": ";
    before = with;
    text += fmt::format("{} {}{}", place_text(field), field.key, when_text(field));
  }
  return text.empty() ? "–" : text;
}

/// Describes the fields of a reply, or names the first command with the same reply.
std::string reply_text(const CommandInfo& command) {
  if (command.echoed) return "echo";
  if (!command.answered) return "none";
  for (const CommandInfo& first : protocol::commands()) {
    if (&first == &command) break;
    if (!first.echoed &&
        std::ranges::equal(first.reply, command.reply, {}, &WireField::name, &WireField::name)) {
      return "as " + hex_text(first.opcode);
    }
  }
  return fields_text(command.reply);
}

std::string exists(const CommandInfo& command) {
  std::string text(command.when.words);
  if (command.fits == protocol::Fits::kAllSeries) return text;
  if (!text.empty()) text += ", ";
  return text + (command.fits == protocol::Fits::kMsOnly ? "MS" : "not MS");
}

std::string_view letters(protocol::Source source) {
  constexpr std::string_view kLetters[] = {"[M]", "[M][H]", "[H]", "[N]", "[N2]", "[T]"};
  return kLetters[static_cast<std::size_t>(source)];
}

std::string_view lsb_text(protocol::Scale scale) {
  using protocol::Scale;
  switch (scale) {
    case Scale::kOne:
      return "1";
    case Scale::kHundredth:
    case Scale::kCenti:
      return "0.01";
    case Scale::kThousandth:
      return "0.001";
    case Scale::kIqCommand:
    case Scale::kIqReply:
    case Scale::kPhaseCurrent:
    case Scale::kVoltage:
      return "by generation";
    case Scale::kFlag:
    case Scale::kBridge:
      return "–";
  }
  return "";
}

/// Returns the unit as written after a number; "count" for counts.
std::string unit_text(protocol::Unit unit) {
  const std::string_view symbol =
      unit == protocol::Unit::kCounts ? "count" : protocol::texts_of(unit).symbol;
  return (symbol.empty() || symbol == "°" ? "" : " ") + std::string(symbol);
}

std::string command_rows() {
  std::string text =
      "| DATA[0] | name | query | reply | only with | |\n|---|---|---|---|---|---|\n";
  for (const CommandInfo& command : protocol::commands()) {
    text += fmt::format("| {} | {} | {} | {} | {} | {} |\n", hex_text(command.opcode), command.name,
                        fields_text(command.query), reply_text(command), exists(command),
                        letters(command.source));
  }
  text +=
      "\n| identifier | name | for the drives 1 to 4 | one LSB | only with | "
      "|\n|---|---|---|---|---|---|\n";
  for (const CommandInfo& command : protocol::multi_drive_commands()) {
    std::string places;
    for (const WireField& field : command.query) places += place_text(field) + " ";
    const WireField& first = command.query.front();
    text += fmt::format("| {} | {} | {}{} | {}{} | {} | {} |\n", hex_text(command.identifier),
                        command.name, places, type_text(first.wire),
                        first.unit != protocol::Unit::kNone ? lsb_text(first.scale) : "",
                        unit_text(first.unit), exists(command), letters(command.source));
  }
  return text;
}

std::string range_text(const WireField& field) {
  using protocol::Range;
  switch (field.range) {
    case Range::kWidth:
      return "";
    case Range::kWords: {
      std::vector<std::string> words;
      for (const protocol::Value& value : field.values) {
        words.push_back(fmt::format("{} {}", value.number, value.word));
      }
      return fmt::format("{}", fmt::join(words, "; "));
    }
    case Range::kIqCommand:
      return "±2000, ±2048 (`iq_command_limit_lsb`)";
    case Range::kIqLimit:
      return "0..`iq_command_limit_lsb`; 0: none";
    case Range::kIqReply:
      return "±2048";
    case Range::kOpenLoop:
      return "±850; oldest drives on RS-485: ±1000";
    case Range::kPowerReply:
      return "±1000";
    case Range::kTurn:
      return "0..35999";
    case Range::kCircle:
      return "0..what 0x94 can read";
    case Range::kMaxSpeed:
      return "± Max Speed";
    case Range::kMaxAngle:
      return "± Max Angle";
    case Range::kEncoder:
      return "0..the largest count";
    case Range::kNotNegative:
      return "from 0";
    case Range::kMaxCurrent:
      return "0..`iq_command_limit_lsb`; MS: 0..850";
    case Range::kMaxTorque:
      return "0..2000; MS: 0..850";
    case Range::kBetween:
      return fmt::format("{}..{}", field.min, field.max);
    case Range::kSpeedSetting:
    case Range::kAngleSetting:
    case Range::kCurrentRamp:
      return "§10.5";
  }
  return "";
}

std::string_view beyond_text(const WireField& field) {
  if (field.range == protocol::Range::kWidth) return "";
  switch (field.beyond) {
    case protocol::Beyond::kClamped:
    case protocol::Beyond::kDriveClamps:
      return "the nearest";
    case protocol::Beyond::kNotExecuted:
      return "answered, not executed";
    case protocol::Beyond::kUnknownCommand:
      return "no reply";
  }
  return "";
}

std::string field_row(const WireField& field) {
  return fmt::format("| {} | {} | {} | {}{} | {} | {} |\n", field.key, field.label,
                     type_text(field.wire), lsb_text(field.scale), unit_text(field.unit),
                     range_text(field), beyond_text(field));
}

std::string field_rows() {
  std::string text =
      "| field | | type | one LSB | range | beyond it |\n|---|---|---|---|---|---|\n";
  std::vector<std::string> rows;
  for (const CommandInfo& command : protocol::commands()) {
    for (const auto fields : {command.query, command.reply}) {
      for (const WireField& field : fields) {
        const std::string row = field_row(field);
        if (std::ranges::find(rows, row) == rows.end()) rows.push_back(row);
      }
    }
  }
  return text + fmt::format("{}", fmt::join(rows, ""));
}

// --- RS-485

/// Describes fields. All fields that DATA[1] selects are described as one.
std::string data_text(std::span<const WireField> fields) {
  std::string text;
  bool parameters = false;
  for (const WireField& field : fields) {
    if (field.parameter >= 0) {
      parameters = true;
      continue;
    }
    text += fmt::format("{}{} {} {}{}{}", text.empty() ? "" : ", ", place_text(field, 1, "D"),
                        field.key, type_text(field.wire), field.optional ? ", may be left out" : "",
                        when_text(field));
  }
  if (parameters) text += ", its value";
  return text.empty() ? "–" : text;
}

/// Lists the generations for whose format on CAN or RS-485 (`framing`) `has` returns true.
template <class Has>
std::string generations(Framing framing, Series series, Has has) {
  std::vector<std::string_view> names;
  for (const protocol::GenerationRow& row : protocol::kGenerationRows) {
    const protocol::Dialect& dialect = framing == Framing::kCan ? row.dialect : row.serial;
    if (has(protocol::wire_format(dialect, series))) names.push_back(row.name);
  }
  if (names.size() == protocol::kGenerationRows.size()) return "all";
  return fmt::format("{}", fmt::join(names, ", "));
}

/// Lists the generations that have the command on CAN or RS-485, in a series that has it.
std::string known_by(const CommandInfo* command, Framing framing) {
  if (command == nullptr) return "–";
  const Series series = command->fits == protocol::Fits::kMsOnly ? Series::kMs : Series::kMf;
  const std::string text = generations(
      framing, series, [&](const auto& format) { return protocol::knows(format, *command); });
  return text.empty() ? "none" : text;
}

std::string serial_row(const CommandInfo& command, const CommandInfo* on_can) {
  const bool bytes = command.query_len != nullptr;
  const std::string reply = command.echoed          ? "echo"
                            : !command.answered     ? "none"
                            : command.reply.empty() ? "bytes below, or none"
                                                    : data_text(command.reply);
  return fmt::format("| {} | {} | {} | {} | {} | {} |\n",
                     command.identifier != 0 ? fmt::format("02 {:02X}", command.identifier - 0x200)
                                             : hex_text(command.opcode),
                     command.name, bytes ? "bytes below" : data_text(command.query), reply,
                     known_by(&command, Framing::kSerial), known_by(on_can, Framing::kCan));
}

// --- generations

/// A switch, and the commands and fields that depend on it.
struct SwitchRow {
  protocol::When when;
  std::vector<std::string> decides;  // "0x8C", "0x9A voltage"
};

std::string name_of(const CommandInfo& command) {
  return command.identifier != 0 ? hex_text(command.identifier) : hex_text(command.opcode);
}

void add(std::vector<SwitchRow>& rows, const protocol::When& when, const std::string& what) {
  if (when.words.empty()) return;
  auto row =
      std::ranges::find(rows, when.words, [](const SwitchRow& one) { return one.when.words; });
  if (row == rows.end()) row = rows.insert(rows.end(), {when, {}});
  if (std::ranges::find(row->decides, what) == row->decides.end()) row->decides.push_back(what);
}

/// Returns the switches that the tables use, each once, in the order of first use.
std::vector<SwitchRow> switch_rows() {
  std::vector<SwitchRow> rows;
  for (const auto commands :
       {protocol::commands(), protocol::multi_drive_commands(), protocol::serial_commands()}) {
    for (const CommandInfo& command : commands) {
      add(rows, command.when, name_of(command));
      for (const auto fields : {command.query, command.reply}) {
        for (const protocol::Field& field : fields) {
          if (field.parameter < 0) {
            add(rows, field.when, fmt::format("{} {}", name_of(command), field.key));
          }
        }
      }
    }
  }
  // These depend on the series, not on the generation.
  std::erase_if(rows, [](const SwitchRow& row) {
    return row.when.words == "MS" || row.when.words == "not MS";
  });
  return rows;
}

/// Lists the generations with the switch on CAN or RS-485. `single` and `several` are the commands
/// there; returns a dash if none of them depends on the switch.
std::string generations_with(const SwitchRow& row, Framing framing,
                             std::span<const CommandInfo> single,
                             std::span<const CommandInfo> several) {
  const auto has = [&](const auto& one) { return one.when.words == row.when.words; };
  const auto decided = [&](const CommandInfo& command) {
    return has(command) || std::ranges::any_of(command.query, has) ||
           std::ranges::any_of(command.reply, has);
  };
  if (!std::ranges::any_of(single, decided) && !std::ranges::any_of(several, decided)) return "–";
  const std::string text = generations(framing, Series::kMf, row.when.on);
  return text.empty() ? "–" : text;
}

}  // namespace

std::string serial_command_page() {
  std::string text =
      "| CMD | name | query | reply | on RS-485 | on CAN |\n|---|---|---|---|---|---|\n";
  for (const CommandInfo& command : protocol::serial_commands()) {
    text += serial_row(command, protocol::find_command(static_cast<std::uint8_t>(command.opcode)));
  }
  return text;
}

std::string generation_page() {
  std::string text = "| switch | what it decides about | on CAN | on RS-485 |\n|---|---|---|---|\n";
  for (const SwitchRow& row : switch_rows()) {
    text += fmt::format("| `{}` | {} | {} | {} |\n", row.when.words, fmt::join(row.decides, ", "),
                        generations_with(row, Framing::kCan, protocol::commands(),
                                         protocol::multi_drive_commands()),
                        generations_with(row, Framing::kSerial, protocol::serial_commands(),
                                         protocol::serial_multi_drive_commands()));
  }
  return text;
}

std::string command_page() { return command_rows() + "\n" + field_rows(); }

}  // namespace lk::formats
