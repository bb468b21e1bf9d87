#include "tools/formats/fields.hpp"

#include <algorithm>
#include <utility>

#include "protocol/commands.hpp"
#include "protocol/field_values.hpp"
#include "protocol/multi_drive_commands.hpp"

namespace lk::formats {
namespace {

Field field_of(const protocol::Field& row, const protocol::WireFormat& format) {
  // Writes per mille as percent, which the programs that read these files know.
  const bool permille = row.unit == protocol::Unit::kPermille;
  const protocol::UnitTexts unit =
      permille ? protocol::UnitTexts{"%", "%"} : protocol::texts_of(row.unit);
  const auto range = protocol::raw_range(row, format);
  return {.name = row.name,
          .label = row.label,
          .first_bit = 8U * row.byte,
          .bits = 8U * static_cast<unsigned>(protocol::bytes_of(row.wire)),
          .is_signed = protocol::is_signed(row.wire),
          .lsb = protocol::lsb(row.scale, format) * (permille ? 0.1 : 1),
          .unit = unit,
          .raw_min = range.min,
          .raw_max = range.max,
          .values = {row.values.begin(), row.values.end()}};
}

/// Sets the selector of `field`: the field in DATA[1] for parameters, in DATA[2] for settings.
void find_selector(std::vector<Field>& fields, const protocol::Field& row, Field& field) {
  if (row.parameter < 0) return;
  field.only_at = static_cast<unsigned>(row.item >= 0 ? row.item : row.parameter);
  const unsigned at = row.item >= 0 ? 2 : 1;
  const auto selector = std::ranges::find_if(fields, [&](const Field& one) {
    return one.first_bit == 8 * at && one.bits == 8 && !one.values.empty();
  });
  selector->selects = true;
  field.selector = selector->name;
}

}  // namespace

std::vector<Field> fields_of(std::span<const protocol::Field> rows,
                             const protocol::WireFormat& format) {
  std::vector<Field> fields;
  for (const protocol::Field& row : rows) {
    if (!row.when.on(format)) continue;
    for (std::size_t bit = 0; bit < row.flags.size(); ++bit) {
      fields.push_back({.name = row.flags[bit].name,
                        .label = row.flags[bit].label,
                        .first_bit = 8U * row.byte + static_cast<unsigned>(bit),
                        .bits = 1,
                        .raw_max = 1,
                        .values = {{0, "no"}, {1, "yes"}}});
    }
    if (!row.flags.empty()) continue;
    Field field = field_of(row, format);
    find_selector(fields, row, field);
    fields.push_back(std::move(field));
  }
  return fields;
}

std::vector<Field> multi_drive_fields(const protocol::CommandInfo& command,
                                      const protocol::WireFormat& format) {
  std::vector<Field> fields = fields_of(command.query, format);
  if (command.identifier != protocol::MultiCommand::kIdentifier) return fields;
  for (Field& field : fields) {
    field.values = {{protocol::kNoCommand, "nothing"}};
    for (const Value& known : command_values(format)) field.values.push_back(known);
  }
  return fields;
}

std::vector<Value> command_values(const protocol::WireFormat& format) {
  std::vector<Value> known;
  for (const auto& command : protocol::commands()) {
    if (!protocol::knows(format, command)) continue;
    known.push_back({static_cast<unsigned>(command.opcode), command.name});
  }
  return known;
}

}  // namespace lk::formats
