#include "tools/formats/command_page.hpp"

#include <algorithm>
#include <cstdio>
#include <string_view>
#include <vector>

#include "protocol/command_info.hpp"

namespace lk::formats {
namespace {

using protocol::CommandInfo;
using WireField = protocol::Field;

std::string hex_text(unsigned number) {
  char buffer[16];
  std::snprintf(buffer, sizeof buffer, "0x%02X", number);
  return buffer;
}

/// Returns text like "`[4:7]`" or "`[1]`".
std::string place_text(const WireField& field) {
  const int last = field.byte + protocol::bytes_of(field.wire) - 1;
  std::string text = "`[" + std::to_string(field.byte);
  if (last > field.byte) text += ":" + std::to_string(last);
  return text + "]`";
}

std::string_view type_text(protocol::Wire wire) {
  constexpr std::string_view kTypes[] = {"uint8", "int8",          "uint16", "int16", "uint32",
                                         "int32", "signed 56 bit", "uint24", "int64"};
  return kTypes[static_cast<std::size_t>(wire)];
}

/// Returns text like "0x0A" or "0x05 0xE2"; empty if the field is always present.
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
    text.append(place_text(field)).append(" ").append(field.key);
    if (!field.when.words.empty()) text.append(" (").append(field.when.words).append(")");
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
      return "as " + hex_text(static_cast<unsigned>(first.opcode));
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

/// Returns the unit as written after a number.
std::string unit_text(protocol::Unit unit) {
  const std::string_view symbol =
      unit == protocol::Unit::kCounts ? "count" : protocol::texts_of(unit).symbol;
  return (symbol.empty() || symbol == "°" ? "" : " ") + std::string(symbol);
}

std::string command_rows() {
  std::string text =
      "| DATA[0] | name | query | reply | only with | |\n|---|---|---|---|---|---|\n";
  for (const CommandInfo& command : protocol::commands()) {
    text += "| " + hex_text(static_cast<unsigned>(command.opcode)) + " | " +
            std::string(command.name) + " | " + fields_text(command.query) + " | " +
            reply_text(command) + " | " + exists(command) + " | " +
            std::string(letters(command.source)) + " |\n";
  }
  text +=
      "\n| identifier | name | for the drives 1 to 4 | one LSB | only with | "
      "|\n|---|---|---|---|---|---|\n";
  for (const CommandInfo& command : protocol::multi_drive_commands()) {
    text += "| " + hex_text(command.identifier) + " | " + std::string(command.name) + " | ";
    for (const WireField& field : command.query) text += place_text(field) + " ";
    const WireField& first = command.query.front();
    text.append(type_text(first.wire)).append(" | ");
    if (first.unit != protocol::Unit::kNone) text.append(lsb_text(first.scale));
    text.append(unit_text(first.unit)).append(" | ");
    text += exists(command) + " | " + std::string(letters(command.source)) + " |\n";
  }
  return text;
}

std::string range_text(const WireField& field) {
  using protocol::Range;
  switch (field.range) {
    case Range::kWidth:
      return "";
    case Range::kWords: {
      std::string text;
      for (const protocol::Value& value : field.values) {
        text += (text.empty() ? "" : "; ") + std::to_string(value.number) + " " +
                std::string(value.word);
      }
      return text;
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
      return std::to_string(field.min) + ".." + std::to_string(field.max);
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
  return "| " + std::string(field.key) + " | " + std::string(field.label) + " | " +
         std::string(type_text(field.wire)) + " | " + std::string(lsb_text(field.scale)) +
         unit_text(field.unit) + " | " + range_text(field) + " | " +
         std::string(beyond_text(field)) + " |\n";
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
  for (const std::string& row : rows) text += row;
  return text;
}

// --- RS-485

/// Returns text like "D[0:3]" or "D[0]".
std::string data_place(const WireField& field) {
  const int first = field.byte - 1;
  const int last = first + protocol::bytes_of(field.wire) - 1;
  std::string text = "`D[" + std::to_string(first);
  if (last > first) text += ":" + std::to_string(last);
  return text + "]`";
}

/// Describes the fields of a command; fields of parameters count as one.
std::string data_text(std::span<const WireField> fields) {
  std::string text;
  bool parameters = false;
  for (const WireField& field : fields) {
    if (field.parameter >= 0) {
      parameters = true;
      continue;
    }
    text.append(text.empty() ? "" : ", ").append(data_place(field)).append(" ").append(field.key);
    text.append(" ").append(type_text(field.wire));
    if (field.optional) text += ", may be left out";
    if (!field.when.words.empty()) text.append(" (").append(field.when.words).append(")");
  }
  if (parameters) text += ", its value";
  return text.empty() ? "–" : text;
}

/// Lists the generations on a wire that have the command, for a series that has it.
std::string known_by(const CommandInfo* command, protocol::Framing framing) {
  if (command == nullptr) return "–";
  const bool ms = command->fits == protocol::Fits::kMsOnly;
  std::string text;
  std::size_t all = 0;
  for (const protocol::GenerationRow& row : protocol::kGenerationRows) {
    const protocol::Dialect& dialect =
        framing == protocol::Framing::kCan ? row.dialect : row.serial;
    const auto series = ms ? protocol::Series::kMs : protocol::Series::kMf;
    if (!protocol::knows(protocol::wire_format(dialect, series), *command)) continue;
    ++all;
    text.append(text.empty() ? "" : ", ").append(row.name);
  }
  if (all == protocol::kGenerationRows.size()) return "all";
  return text.empty() ? "none" : text;
}

std::string serial_row(const CommandInfo& command, const CommandInfo* on_can) {
  const bool bytes = command.query_len != nullptr;
  const std::string number = command.identifier != 0
                                 ? "02 " + hex_text(command.identifier - 0x200).substr(2)
                                 : hex_text(static_cast<unsigned>(command.opcode));
  const std::string reply = command.echoed          ? "echo"
                            : !command.answered     ? "none"
                            : command.reply.empty() ? "bytes below, or none"
                                                    : data_text(command.reply);
  return "| " + number + " | " + std::string(command.name) + " | " +
         (bytes ? std::string("bytes below") : data_text(command.query)) + " | " + reply + " | " +
         known_by(&command, protocol::Framing::kSerial) + " | " +
         known_by(on_can, protocol::Framing::kCan) + " |\n";
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

std::string command_page() { return command_rows() + "\n" + field_rows(); }

}  // namespace lk::formats
