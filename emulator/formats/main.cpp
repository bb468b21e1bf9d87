// Writes the files by which programs of other people read the bus:
// lk-emu-formats DISSECTOR DIRECTORY, which is configs/ of the source tree.

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "emulator/formats/dbc.hpp"
#include "emulator/formats/dissector.hpp"

namespace {

using lk::formats::Direction;
using lk::protocol::Dialect;

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

/// The default generation has the plain names.
void write_dbc(const std::filesystem::path& directory, const std::string& generation,
               const Dialect& dialect, const std::string& name) {
  const auto format = lk::protocol::wire_format(dialect, lk::protocol::Series::kMf);
  write(directory / (name + ".dbc"), lk::formats::dbc(Direction::kReplies, generation, format));
  write(directory / (name + "-queries.dbc"),
        lk::formats::dbc(Direction::kQueries, generation, format));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  try {
    const std::filesystem::path directory = argv[2];
    write_dbc(directory, "legacy", lk::protocol::kLegacyDialect, "lk-motor");
    write_dbc(directory, "v235", lk::protocol::kV235Dialect, "lk-motor-v235");
    write_dbc(directory, "v236", lk::protocol::kV236Dialect, "lk-motor-v236");
    write(directory / "wireshark/lk-motor.lua", lk::formats::dissector(read(argv[1])));
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "lk-emu-formats: %s\n", problem.what());
    return 1;
  }
  return 0;
}
