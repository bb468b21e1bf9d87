#include "emulator/formats/dissector.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "emulator/formats/fields.hpp"

namespace lk::formats {
namespace {

using protocol::Dialect;
using protocol::Opcode;
using protocol::Series;
using protocol::WireFormat;

// In the order of the preferences, which number them from 0.
constexpr std::array<std::pair<std::string_view, Dialect>, 3> kGenerations = {
    {{"legacy", protocol::kLegacyDialect},
     {"v235", protocol::kV235Dialect},
     {"v236", protocol::kV236Dialect}}};
constexpr std::array<std::pair<std::string_view, Series>, 3> kSeries = {
    {{"MF, MH", Series::kMf}, {"MG", Series::kMg}, {"MS", Series::kMs}}};

std::string number(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.15g", value);
  return buffer;
}

std::string quoted(std::string_view text) { return "\"" + std::string(text) + "\""; }

std::string hex(unsigned value) {
  char buffer[16];
  std::snprintf(buffer, sizeof buffer, "0x%02X", value);
  return buffer;
}

/// DBC files are ASCII; here people read it.
std::string unit(std::string_view ascii) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kNicer = {
      {{"degC", "°C"}, {"deg", "°"}, {"deg/s", "°/s"}, {"deg/s^2", "°/s²"}}};
  const auto* const found =
      std::ranges::find(kNicer, ascii, [](const auto& one) { return one.first; });
  return std::string(found != kNicer.end() ? found->second : ascii);
}

/// What Wireshark takes a field for; a name has one kind in all generations.
std::string_view kind(const Field& field) {
  if (field.bits == 1) return "flag";
  if (field.lsb == 1) return field.is_signed ? "int" : "uint";
  return "double";
}

class Tables {
 public:
  std::string text() {
    std::string formats;
    for (const auto& generation : kGenerations) formats += generation_text(generation);
    return commands_text() + "\nlocal names = {\n" + names_text() + "}\n\nlocal layouts = {\n" +
           layouts_ + "}\n\nlocal formats = {\n" + formats + "}\n";
  }

 private:
  std::string commands_text() const {
    std::string text = "local commands = {\n";
    for (const auto& row : protocol::kOpcodes) {
      text += "  [" + hex(static_cast<unsigned>(row.opcode)) + "] = { name = " + quoted(row.name) +
              ", echo = " + (is_echo(row.opcode) ? "true" : "false") + " },\n";
    }
    text += "}\n\nlocal several = {\n";
    for (const auto& row : protocol::kMultiDriveRows) {
      text += "  [" + hex(row.id) + "] = { name = " + quoted(row.name) + " },\n";
    }
    return text + "}\n";
  }

  std::string names_text() const {
    std::string text;
    for (const auto& [name, about] : names_) text += "  " + name + " = { " + about + " },\n";
    return text;
  }

  void learn(const Field& field) {
    std::string about = "label = " + quoted(field.label) + ", kind = " + quoted(kind(field)) +
                        ", unit = " + quoted(unit(field.unit));
    if (!field.values.empty() && field.bits > 1) {
      about += ", values = {";
      for (const Value& value : field.values) {
        about += " [" + std::to_string(value.number) + "] = " + quoted(value.word) + ",";
      }
      about += " }";
    }
    const auto [known, is_new] = names_.emplace(field.name, about);
    // Of the commands in a slot the last generation knows the most.
    if (!is_new && about.size() > known->second.size()) known->second = about;
  }

  /// The place of a list of fields among the layouts.
  std::string layout(const std::vector<Field>& fields) {
    std::string text = "{ ";
    for (const Field& field : fields) {
      learn(field);
      text += "{ " + quoted(field.name) + ", " + std::to_string(field.first_bit) + ", " +
              std::to_string(field.bits) + ", " + (field.is_signed ? "true" : "false") + ", " +
              number(field.lsb);
      if (field.parameter >= 0) text += ", " + std::to_string(field.parameter);
      text += " }, ";
    }
    text += "}";
    const auto [known, is_new] = places_.emplace(text, places_.size() + 1);
    if (is_new) layouts_ += "  " + text + ",\n";
    return "layouts[" + std::to_string(known->second) + "]";
  }

  std::string generation_text(const std::pair<std::string_view, Dialect>& generation) {
    std::string text = "  { -- " + std::string(generation.first) + "\n";
    for (const auto& [series_name, series] : kSeries) {
      text += "    { -- " + std::string(series_name) + "\n";
      text += format_text(protocol::wire_format(generation.second, series)) + "    },\n";
    }
    return text + "  },\n";
  }

  std::string format_text(const WireFormat& format) {
    std::string queries, replies, several;
    for (const Value& command : commands(format)) {
      const auto opcode = static_cast<Opcode>(command.number);
      const std::string key = " [" + hex(command.number) + "] = ";
      queries += key + layout(query_fields(opcode, format)) + ",";
      replies += key + layout(reply_fields(opcode, format)) + ",";
    }
    for (const auto& row : protocol::kMultiDriveRows) {
      if (!knows_multi_drive(format, row.id)) continue;
      several += " [" + hex(row.id) + "] = " + layout(multi_drive_fields(row.id, format)) + ",";
    }
    return "      queries = {" + queries + " },\n      replies = {" + replies +
           " },\n      several = {" + several + " },\n";
  }

  std::map<std::string, std::string, std::less<>> names_;
  std::map<std::string, std::size_t> places_;
  std::string layouts_;
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
