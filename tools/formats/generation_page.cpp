#include "tools/formats/generation_page.hpp"

#include <algorithm>
#include <cstdio>
#include <span>
#include <string_view>
#include <vector>

#include "protocol/command_info.hpp"
#include "protocol/wire_format.hpp"

namespace lk::formats {
namespace {

using protocol::CommandInfo;
using protocol::Framing;
using protocol::Series;

/// A switch, and all that depends on it.
struct SwitchRow {
  protocol::When when;
  std::vector<std::string> decides;  // "0x8C", "0x9A voltage"
};

std::string name_of(const CommandInfo& command) {
  char buffer[16];
  const auto number =
      command.identifier != 0 ? command.identifier : static_cast<unsigned>(command.opcode);
  std::snprintf(buffer, sizeof buffer, "0x%02X", number);
  return buffer;
}

void add(std::vector<SwitchRow>& rows, const protocol::When& when, const std::string& what) {
  if (when.words.empty()) return;
  auto row =
      std::ranges::find(rows, when.words, [](const SwitchRow& one) { return one.when.words; });
  if (row == rows.end()) row = rows.insert(rows.end(), {when, {}});
  if (std::ranges::find(row->decides, what) == row->decides.end()) row->decides.push_back(what);
}

/// Returns the switches of the tables, each once, in the order of first use.
std::vector<SwitchRow> switch_rows() {
  std::vector<SwitchRow> rows;
  for (const auto commands :
       {protocol::commands(), protocol::multi_drive_commands(), protocol::serial_commands()}) {
    for (const CommandInfo& command : commands) {
      add(rows, command.when, name_of(command));
      for (const auto fields : {command.query, command.reply}) {
        for (const protocol::Field& field : fields) {
          if (field.parameter < 0) {
            add(rows, field.when, name_of(command) + " " + std::string(field.key));
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

/// Lists the generations with the switch on a wire.
std::string generations(const protocol::When& when, Framing framing) {
  std::string text;
  std::size_t all = 0;
  for (const protocol::GenerationRow& row : protocol::kGenerationRows) {
    const auto& dialect = framing == Framing::kCan ? row.dialect : row.serial;
    if (!when.on(protocol::wire_format(dialect, Series::kMf))) continue;
    ++all;
    text.append(text.empty() ? "" : ", ").append(row.name);
  }
  return all == protocol::kGenerationRows.size() ? "all" : text.empty() ? "–" : text;
}

bool is_of(const SwitchRow& wanted, std::span<const CommandInfo> single,
           std::span<const CommandInfo> several) {
  const auto decided = [&](const CommandInfo& command) {
    const auto has = [&](const protocol::Field& field) {
      return field.when.words == wanted.when.words;
    };
    return command.when.words == wanted.when.words || std::ranges::any_of(command.query, has) ||
           std::ranges::any_of(command.reply, has);
  };
  return std::ranges::any_of(single, decided) || std::ranges::any_of(several, decided);
}

}  // namespace

std::string generation_page() {
  std::string text = "| switch | what it decides about | on CAN | on RS-485 |\n|---|---|---|---|\n";
  for (const SwitchRow& row : switch_rows()) {
    std::string decides;
    for (const std::string& one : row.decides) decides += (decides.empty() ? "" : ", ") + one;
    text.append("| `").append(row.when.words).append("` | ").append(decides).append(" | ");
    const bool can = is_of(row, protocol::commands(), protocol::multi_drive_commands());
    const bool serial =
        is_of(row, protocol::serial_commands(), protocol::serial_multi_drive_commands());
    text += (can ? generations(row.when, Framing::kCan) : "–") + " | " +
            (serial ? generations(row.when, Framing::kSerial) : "–") + " |\n";
  }
  return text;
}

}  // namespace lk::formats
