#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/formats/fields.hpp"
#include "tools/formats/formats.hpp"

namespace lk::formats {
namespace {

using protocol::Series;
using protocol::WireFormat;

// Series in the order of the dissector's preference, whose numbers start at 0.
constexpr std::array<std::pair<std::string_view, Series>, 3> kSeries = {
    {{"MF, MH", Series::kMf}, {"MG", Series::kMg}, {"MS", Series::kMs}}};

std::string lua_string(std::string_view text) { return fmt::format("\"{}\"", text); }

std::string lua_hex(unsigned value) { return fmt::format("0x{:02X}", value); }

/// Returns the type of a field for Wireshark. A name has the same type in all generations.
std::string_view kind(const Field& field) {
  if (field.bits == 1) return "flag";
  if (field.lsb == 1) return field.is_signed ? "int" : "uint";
  return "double";
}

/// Returns the list for the preference: for each generation its number from 1, its name, its number
/// from 0.
std::string generations_text() {
  std::string text;
  for (std::size_t k = 0; k < protocol::kGenerationRows.size(); ++k) {
    text += fmt::format("{}{{ {}, \"{}\", {} }}", k == 0 ? "" : ", ", k + 1,
                        protocol::kGenerationRows[k].name, k);
  }
  return "local generations = { " + text + " }\n\n";
}

/// Returns how many bytes after the command select a parameter or setting, in query and reply.
std::ptrdiff_t repeats(const protocol::CommandInfo& command) {
  return std::ranges::count_if(command.query, [&](const protocol::Field& field) {
    return protocol::repeats_in_reply(command, field);
  });
}

std::string commands_text() {
  std::string text = "local commands = {\n";
  for (const auto& row : protocol::commands()) {
    text += fmt::format(
        "  [{}] = {{ name = \"{}\", echo = {}, answered = {}, repeats = {}, alike = {} }},\n",
        lua_hex(static_cast<unsigned>(row.opcode)), row.name, row.echoed, row.answered,
        repeats(row), protocol::looks_like_query(row));
  }
  text += "}\n\nlocal several = {\n";
  for (const auto& row : protocol::multi_drive_commands()) {
    text += fmt::format("  [{}] = {{ name = \"{}\" }},\n", lua_hex(row.identifier), row.name);
  }
  return text + "}\n";
}

/// Collects the fields by name, and the different lists of fields, so that each is written once.
class Layouts {
 public:
  std::string format_text(const WireFormat& format) {
    std::string queries, replies, several;
    for (const auto& command : protocol::commands()) {
      if (!protocol::knows(format, command)) continue;
      const std::string byte = lua_hex(static_cast<unsigned>(command.opcode));
      queries += fmt::format(" [{}] = {},", byte, layout(fields_of(command.query, format)));
      replies += fmt::format(" [{}] = {},", byte, layout(fields_of(command.reply, format)));
    }
    for (const auto& row : protocol::multi_drive_commands()) {
      if (!protocol::knows(format, row)) continue;
      several += fmt::format(" [{}] = {},", lua_hex(row.identifier),
                             layout(multi_drive_fields(row, format)));
    }
    return fmt::format(
        "      queries = {{{} }},\n      replies = {{{} }},\n      several = {{{} }},\n", queries,
        replies, several);
  }

  std::string text() const {
    std::string names;
    for (const auto& [name, about] : names_)
      names += fmt::format("  {} = {{ {} }},\n", name, about);
    return "\nlocal names = {\n" + names + "}\n\nlocal layouts = {\n" + layouts_ + "}\n";
  }

 private:
  void learn(const Field& field) {
    std::string about = fmt::format("label = {}, kind = {}, unit = {}", lua_string(field.label),
                                    lua_string(kind(field)), lua_string(field.unit.symbol));
    if (!field.values.empty() && field.bits > 1) {
      about += ", values = {";
      for (const Value& value : field.values) {
        about += fmt::format(" [{}] = \"{}\",", value.number, value.word);
      }
      about += " }";
    }
    std::string& known = names_[std::string(field.name)];
    // Keeps the longest text: the last generation has the most commands for a slot.
    if (about.size() > known.size()) known = about;
  }

  /// Adds a list of fields to the layouts. Returns its name.
  std::string layout(const std::vector<Field>& fields) {
    std::string text = "{";
    for (const Field& field : fields) {
      learn(field);
      text += fmt::format(" {{ {}, {}, {}, {}, {:.15g}", lua_string(field.name), field.first_bit,
                          field.bits, field.is_signed, field.lsb);
      if (!field.selector.empty()) {
        text += fmt::format(", {}, {}", lua_string(field.selector), field.only_at);
      }
      text += " },";
    }
    text += " }";
    const auto [known, is_new] = places_.emplace(text, places_.size() + 1);
    if (is_new) layouts_ += "  " + text + ",\n";
    return fmt::format("layouts[{}]", known->second);
  }

  std::map<std::string, std::string> names_;
  std::map<std::string, std::size_t> places_;
  std::string layouts_;
};

std::string tables_text() {
  Layouts layouts;
  std::string formats;
  for (const auto& generation : protocol::kGenerationRows) {
    formats += fmt::format("  {{ -- {}\n", generation.name);
    for (const auto& [series_name, series] : kSeries) {
      const auto format = protocol::wire_format(generation.dialect, series);
      formats += fmt::format("    {{ -- {}\n{}    }},\n", series_name, layouts.format_text(format));
    }
    formats += "  },\n";
  }
  return generations_text() + commands_text() + layouts.text() + "\nlocal formats = {\n" + formats +
         "}\n";
}

}  // namespace

std::string dissector(const std::string& program) {
  constexpr std::string_view kPlace = "-- @tables\n";
  const auto place = program.find(kPlace);
  if (place == std::string::npos) throw std::runtime_error("the dissector has no line -- @tables");
  std::string text = program;
  return text.replace(place, kPlace.size(), tables_text());
}

}  // namespace lk::formats
