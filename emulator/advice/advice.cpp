#include "emulator/advice/advice.hpp"

#include <algorithm>
#include <cstddef>
#include <string_view>

#include "emulator/core/frame_text.hpp"
#include "emulator/core/scenario/scenario_text.hpp"
#include "protocol/command_info.hpp"
#include "protocol/wire_format.hpp"

namespace lk::emulator {
namespace {

/// Names of the generations that have the command: "legacy, late-legacy".
std::string generations_with(const protocol::CommandInfo& command, protocol::Framing framing) {
  std::string names;
  for (const protocol::GenerationRow& row : protocol::kGenerationRows) {
    if (!has(row, command, framing)) continue;
    names += (names.empty() ? "" : ", ") + std::string(row.name);
  }
  return names;
}

/// Returns the replacement for {word}.
std::string stand_in(std::string_view word, const Finding& found, protocol::Framing framing) {
  if (word.size() == 1) {
    return number_text(found.numbers[static_cast<std::size_t>(word.front() - '1')]);
  }
  const std::uint8_t byte = found.command.value_or(0);
  constexpr char kDigits[] = "0123456789ABCDEF";
  if (word == "command") return {'0', 'x', kDigits[byte >> 4U], kDigits[byte & 0xFU]};
  const protocol::CommandInfo* const command = protocol::find_command(byte, framing);
  if (command == nullptr) return "";
  if (word == "generations") return generations_with(*command, framing);
  if (word == "key") return std::string(command->when.words);
  return std::string(command->name);  // "name"
}

std::string filled(std::string_view pattern, const Finding& found, protocol::Framing framing) {
  std::string text;
  while (!pattern.empty()) {
    const std::size_t open = std::min(pattern.find('{'), pattern.size());
    text += pattern.substr(0, open);
    pattern.remove_prefix(open);
    if (pattern.empty()) break;
    const std::size_t close = pattern.find('}');
    text += stand_in(pattern.substr(1, close - 1), found, framing);
    pattern.remove_prefix(close + 1);
  }
  return text;
}

constexpr Words kOnce{" time, first ", " 次，首次 "};
constexpr Words kTimes{" times, first ", " 次，首次 "};
constexpr Words kOpen{" (", "（"};
constexpr Words kAt{" at {1} s): ", "，{1} s）："};

}  // namespace

bool has(const protocol::GenerationRow& row, const protocol::CommandInfo& command,
         protocol::Framing framing) {
  const bool serial = framing == protocol::Framing::kSerial;
  return command.when.on(protocol::wire_format(serial ? row.serial : row.dialect, Series::kMf));
}

bool same_cause(const Finding& one, const Finding& other) {
  return one.kind == other.kind &&
         (!advice_row(one.kind).apiece || (one.what == other.what && one.command == other.command));
}

std::string what_text(const Advice& advice, Language language) {
  return filled(advice.found.what->in(language), advice.found, protocol::framing_of(advice.frame));
}

std::string todo_text(const Advice& advice, Language language) {
  const Finding& found = advice.found;
  const auto framing = protocol::framing_of(advice.frame);
  const AdviceRow& row = advice_row(found.kind);
  const bool own = framing == protocol::Framing::kSerial && !row.serial_todo.en.empty();
  const Words& todo = found.todo != nullptr ? *found.todo : own ? row.serial_todo : row.todo;
  return filled(todo.in(language), found, framing);
}

std::string advice_line(const std::string& bus, const Advice& advice, Language language) {
  std::string text = bus;
  if (advice.id != 0) text += ":" + std::to_string(advice.id);
  text += ": " + std::string(advice_row(advice.found.kind).word) + ": ";
  text += what_text(advice, language);
  text += std::string(kOpen.in(language)) + std::to_string(advice.count);
  text += (advice.count == 1 ? kOnce : kTimes).in(language);
  text += frame_text(advice.frame);
  const double first_s = std::chrono::duration<double>(advice.first).count();
  text +=
      filled(kAt.in(language), {advice.found.kind, nullptr, {first_s}}, protocol::Framing::kCan);
  return text + todo_text(advice, language);
}

}  // namespace lk::emulator
