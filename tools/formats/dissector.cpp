#include "tools/formats/dissector.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/formats/fields.hpp"

namespace lk::formats {
namespace {

using protocol::Series;
using protocol::WireFormat;

// In the order of the preferences, whose numbers start at 0.
constexpr std::array<std::pair<std::string_view, Series>, 3> kSeries = {
    {{"MF, MH", Series::kMf}, {"MG", Series::kMg}, {"MS", Series::kMs}}};

std::string lua_number(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.15g", value);
  return buffer;
}

std::string lua_string(std::string_view text) {
  std::string out = "\"";
  return out.append(text).append("\"");
}

std::string lua_hex(unsigned value) {
  char buffer[16];
  std::snprintf(buffer, sizeof buffer, "0x%02X", value);
  return buffer;
}

/// Returns the type of a field for Wireshark; a name has one type in all generations.
std::string_view kind(const Field& field) {
  if (field.bits == 1) return "flag";
  if (field.lsb == 1) return field.is_signed ? "int" : "uint";
  return "double";
}

class Tables {
 public:
  std::string text() {
    std::ostringstream formats;
    for (const auto& generation : protocol::kGenerationRows) {
      formats << "  { -- " << generation.name << "\n";
      for (const auto& [series_name, series] : kSeries) {
        formats << "    { -- " << series_name << "\n";
        put_format(formats, protocol::wire_format(generation.dialect, series));
        formats << "    },\n";
      }
      formats << "  },\n";
    }
    std::ostringstream out;
    put_generations(out);
    put_commands(out);
    out << "\nlocal names = {\n";
    for (const auto& [name, about] : names_) out << "  " << name << " = { " << about << " },\n";
    out << "}\n\nlocal layouts = {\n" << layouts_.str() << "}\n\nlocal formats = {\n";
    out << formats.str() << "}\n";
    return out.str();
  }

 private:
  /// Writes the generations for a preference: a number from 1, the name, the number from 0.
  static void put_generations(std::ostream& out) {
    out << "local generations = {";
    for (std::size_t k = 0; k < protocol::kGenerationRows.size(); ++k) {
      const std::string_view name = protocol::kGenerationRows[k].name;
      out << (k == 0 ? " " : ", ") << "{ " << k + 1 << ", " << lua_string(name) << ", " << k
          << " }";
    }
    out << " }\n\n";
  }

  /// Returns how many bytes after the command select a parameter or setting, in query and reply.
  static int repeats(const protocol::CommandInfo& command) {
    return static_cast<int>(std::ranges::count_if(command.query, [&](const protocol::Field& field) {
      return protocol::repeats_in_reply(command, field);
    }));
  }

  static void put_commands(std::ostream& out) {
    out << "local commands = {\n";
    for (const auto& row : protocol::commands()) {
      out << "  [" << lua_hex(static_cast<unsigned>(row.opcode))
          << "] = { name = " << lua_string(row.name)
          << ", echo = " << (row.echoed ? "true" : "false")
          << ", answered = " << (row.answered ? "true" : "false") << ", repeats = " << repeats(row)
          << ", alike = " << (protocol::looks_like_query(row) ? "true" : "false") << " },\n";
    }
    out << "}\n\nlocal several = {\n";
    for (const auto& row : protocol::multi_drive_commands()) {
      out << "  [" << lua_hex(row.identifier) << "] = { name = " << lua_string(row.name) << " },\n";
    }
    out << "}\n";
  }

  void learn(const Field& field) {
    std::ostringstream about;
    about << "label = " << lua_string(field.label) << ", kind = " << lua_string(kind(field))
          << ", unit = " << lua_string(field.unit.symbol);
    if (!field.values.empty() && field.bits > 1) {
      about << ", values = {";
      for (const Value& value : field.values) {
        about << " [" << value.number << "] = " << lua_string(value.word) << ",";
      }
      about << " }";
    }
    const auto [known, is_new] = names_.emplace(field.name, about.str());
    // Keeps the longest text: the last generation has the most commands for a slot.
    if (!is_new && about.str().size() > known->second.size()) known->second = about.str();
  }

  /// Adds a list of fields to the layouts, each list once. Returns its name.
  std::string layout(const std::vector<Field>& fields) {
    std::ostringstream text;
    text << "{";
    for (const Field& field : fields) {
      learn(field);
      text << " { " << lua_string(field.name) << ", " << field.first_bit << ", " << field.bits
           << ", " << (field.is_signed ? "true" : "false") << ", " << lua_number(field.lsb);
      if (!field.selector.empty()) {
        text << ", " << lua_string(field.selector) << ", " << field.only_at;
      }
      text << " },";
    }
    text << " }";
    const auto [known, is_new] = places_.emplace(text.str(), places_.size() + 1);
    if (is_new) layouts_ << "  " << text.str() << ",\n";
    std::ostringstream name;
    name << "layouts[" << known->second << "]";
    return name.str();
  }

  void put_format(std::ostream& out, const WireFormat& format) {
    std::ostringstream queries;
    std::ostringstream replies;
    std::ostringstream several;
    for (const auto& command : protocol::commands()) {
      if (!protocol::knows(format, command)) continue;
      const std::string byte = lua_hex(static_cast<unsigned>(command.opcode));
      queries << " [" << byte << "] = " << layout(fields_of(command.query, format)) << ",";
      replies << " [" << byte << "] = " << layout(fields_of(command.reply, format)) << ",";
    }
    for (const auto& row : protocol::multi_drive_commands()) {
      if (!protocol::knows(format, row)) continue;
      several << " [" << lua_hex(row.identifier)
              << "] = " << layout(multi_drive_fields(row, format)) << ",";
    }
    out << "      queries = {" << queries.str() << " },\n      replies = {" << replies.str()
        << " },\n      several = {" << several.str() << " },\n";
  }

  std::map<std::string, std::string, std::less<>> names_;
  std::map<std::string, std::size_t> places_;
  std::ostringstream layouts_;
};

}  // namespace

std::string dissector(const std::string& program) {
  constexpr std::string_view kPlace = "-- @tables\n";
  const auto place = program.find(kPlace);
  if (place == std::string::npos) throw std::runtime_error("the dissector has no line -- @tables");
  std::string text = program;
  return text.replace(place, kPlace.size(), Tables().text());
}

}  // namespace lk::formats
