#include "tools/campaign/plan/host_words.hpp"

#include <array>
#include <fstream>
#include <stdexcept>
#include <utility>

#include "tools/cases/case_files.hpp"

namespace lk::emulator {

std::vector<std::string> command_words(std::string_view line) {
  std::vector<std::string> words;
  char quote = 0;
  bool in_word = false;
  for (const char c : line) {
    if (quote != 0 ? c == quote : c == '\'' || c == '"') {
      quote = quote != 0 ? 0 : c;
      if (!std::exchange(in_word, true)) words.emplace_back();
    } else if (quote == 0 && (c == ' ' || c == '\t' || c == '\n')) {
      in_word = false;
    } else {
      if (!std::exchange(in_word, true)) words.emplace_back();
      words.back() += c;
    }
  }
  if (quote != 0) throw std::invalid_argument(std::string("no end of ") + quote);
  return words;
}

std::uint64_t files_hash(const std::vector<std::string>& words,
                         const std::filesystem::path& directory, std::uint64_t so_far) {
  for (const std::string& word : words) {
    const std::filesystem::path file = directory / word;
    std::error_code none;
    if (word.empty() || !std::filesystem::is_regular_file(file, none)) continue;
    std::ifstream in(file, std::ios::binary);
    std::array<char, 65536> part;
    while (in.read(part.data(), part.size()), in.gcount() > 0) {
      so_far = text_hash({part.data(), static_cast<std::size_t>(in.gcount())}, so_far);
    }
  }
  return so_far;
}

}  // namespace lk::emulator
