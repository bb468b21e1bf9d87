// Writes the manual page and the completions: lk-emu-manual DIRECTORY DATE

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>

#include "tools/manual/completions.hpp"
#include "tools/manual/man_page.hpp"

namespace {

void write(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream stream;
  stream.exceptions(std::ios::badbit | std::ios::failbit);
  stream.open(file, std::ios::binary);
  stream << text;
  stream.close();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  try {
    const std::filesystem::path directory = argv[1];
    const lk::manual::Word program = lk::manual::read_program();
    write(directory / "lk-emu.1", lk::manual::man_page(program, argv[2]));
    write(directory / "bash/lk-emu", lk::manual::bash_completion(program));
    write(directory / "fish/lk-emu.fish", lk::manual::fish_completion(program));
    write(directory / "zsh/_lk-emu", lk::manual::zsh_completion(program));
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "lk-emu-manual: %s\n", problem.what());
    return 1;
  }
  return 0;
}
