#include "tools/manual/values.hpp"

#include <algorithm>

#include "emulator/config/config_quirks.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/servo/signals.hpp"
#include "emulator/files/profile_files.hpp"
#include "tools/commands/cli.hpp"

namespace lk::manual {
namespace {

std::vector<std::string> fault_words() {
  std::vector<std::string> words;
  for (const emulator::FaultRow& row : emulator::fault_table()) words.emplace_back(row.word);
  return words;
}

std::vector<std::string> signal_words() {
  std::vector<std::string> words;
  for (const emulator::Signal& signal : emulator::signals()) words.emplace_back(signal.name);
  return words;
}

/// What is a file or has a name.
std::vector<std::string> file_words(const std::string& part) {
  if (part == "MOTOR") return emulator::motor_words();
  if (part == "ROBOT") return emulator::known_files(emulator::kRobots);
  if (part == "SCENARIO") return emulator::known_files(emulator::kScenarios);
  return {};
}

/// Words that are to be typed as they are have small letters.
bool is_literal(const std::string& part) {
  return std::ranges::all_of(part, [](char c) { return c >= 'a' && c <= 'z'; });
}

void add_part(Choices& choices, const std::string& part) {
  std::vector<std::string> words = file_words(part);
  choices.files |= part == "FILE" || part == "PATH" || !words.empty();
  choices.directories |= part == "DIR";
  choices.interfaces |= part == "BUS";
  choices.list |= part == "SIGNALS";
  if (part == "FAULT") words = fault_words();
  if (part == "SIGNALS") words = signal_words();
  if (part == "MODE") words = {"realtime", "stepped", "x0.1", "x10"};
  if (part == "GENERATION") words = emulator::generation_words();
  if (part == "LANG") words = {"en", "zh"};
  if (part == "LEVEL")
    words.assign(std::begin(emulator::kLogLevels), std::end(emulator::kLogLevels));
  if (is_literal(part)) words = {part};
  choices.words.insert(choices.words.end(), words.begin(), words.end());
}

}  // namespace

Choices choices_of(const std::string& value) {
  Choices choices;
  for (std::size_t begin = 0; begin < value.size();) {
    const std::size_t end = std::min(value.find('|', begin), value.size());
    add_part(choices, value.substr(begin, end - begin));
    begin = end + 1;
  }
  return choices;
}

}  // namespace lk::manual
