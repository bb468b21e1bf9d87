// Writes the DBC files and the Wireshark dissector: lk-emu-formats DISSECTOR DIRECTORY. Without
// arguments, prints the generated part of docs/reference/protocol.md. With --generations, prints
// the table of its §10.1; with --serial, the table of docs/reference/rs485.md.

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "tools/formats/formats.hpp"

namespace {

using lk::formats::Direction;

std::string read(const std::filesystem::path& file) {
  std::ifstream stream;
  stream.exceptions(std::ios::badbit | std::ios::failbit);
  stream.open(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

void write(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream stream;
  stream.exceptions(std::ios::badbit | std::ios::failbit);
  stream.open(file, std::ios::binary);
  stream << text;
  stream.close();
}

/// Writes the DBC files of a generation. The names for the default generation have no suffix.
void write_dbc(const std::filesystem::path& directory, const lk::protocol::GenerationRow& row) {
  const auto format = lk::protocol::wire_format(row.dialect, lk::protocol::Series::kMf);
  std::string name = "lk-motor";
  if (row.dialect != lk::protocol::kLegacyDialect) name.append("-").append(row.name);
  write(directory / (name + ".dbc"), lk::formats::dbc(Direction::kReplies, row.name, format));
  write(directory / (name + "-queries.dbc"),
        lk::formats::dbc(Direction::kQueries, row.name, format));
}

}  // namespace

int main(int argc, char** argv) {
  const std::string option = argc == 2 ? argv[1] : "";
  const auto page = argc == 1                   ? lk::formats::command_page
                    : option == "--generations" ? lk::formats::generation_page
                    : option == "--serial"      ? lk::formats::serial_command_page
                                                : nullptr;
  if (page != nullptr) return std::fputs(page().c_str(), stdout) < 0 ? 1 : 0;
  if (argc != 3) return 2;
  try {
    const std::filesystem::path directory = argv[2];
    for (const auto& row : lk::protocol::kGenerationRows) write_dbc(directory, row);
    write(directory / "wireshark/lk-motor.lua", lk::formats::dissector(read(argv[1])));
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "lk-emu-formats: %s\n", problem.what());
    return 1;
  }
  return 0;
}
