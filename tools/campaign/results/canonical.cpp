#include "tools/campaign/results/canonical.hpp"

#include <charconv>
#include <concepts>

#include "emulator/ground/text.hpp"
#include "tools/campaign/results/columns.hpp"

namespace lk::emulator {
namespace {

/// As much of it at a time as makes writing cheap.
constexpr std::size_t kBlock = 1 << 16;

/// Shortest, as std::to_chars has it: the same whatever the locale is.
template <class Number>
void add_number(std::string& line, Number value) {
  char buffer[32];
  line.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}

void add_text(std::string& line, std::string_view any) {
  const std::string text = on_one_line(any);
  if (text.find_first_of(",\"") == std::string::npos) {
    line += text;
    return;
  }
  line += '"';
  for (const char c : text) {
    if (c == '"') line += '"';
    line += c;
  }
  line += '"';
}

void add_value(std::string& line, const std::optional<CaseValue>& value) {
  if (!value) return;
  if (const double* const number = std::get_if<double>(&*value)) {
    add_number(line, *number);
  } else {
    add_text(line, std::get<std::string>(*value));
  }
}

struct AddColumn {
  std::string& line;
  void operator()(const char*, CaseOutcome outcome) { add_text(line += ',', to_string(outcome)); }
  void operator()(const char*, std::uint32_t count) { add_number(line += ',', count); }
  void operator()(const char*, bool flag) { line += flag ? ",1" : ",0"; }
  void operator()(const char*, const std::optional<SimTime>& time) {
    line += ',';
    if (time) add_number(line, time->count());
  }
  void operator()(const char*, Word<const std::string> word) { add_text(line += ',', word.text); }
  void operator()(const char*, const std::optional<double>& value) {
    line += ',';
    if (value) add_number(line, *value);
  }
  void operator()(const char*, const std::string& text) { add_text(line += ',', text); }
};

void add_case(std::string& text, const CaseResult& result) {
  add_number(text, result.number);
  for (const auto& value : result.values) add_value(text += ',', value);
  each_column(result, AddColumn{text});
  text += '\n';
}

}  // namespace

std::string canonical_header(const CampaignHead& head) {
  std::string line = "number";
  for (const auto& dimension : head.dimensions) add_text(line += ',', dimension.name);
  each_column([&](const char* name, const auto&) { (line += ',') += name; });
  return line + '\n';
}

std::string canonical_line(const CaseResult& result) {
  std::string line;
  add_case(line, result);
  return line;
}

void export_canonical(const CampaignStore& store,
                      const std::function<void(std::string_view)>& write) {
  std::string text = canonical_header(store.head());
  store.for_each([&](const CaseResult& result) {
    add_case(text, result);
    if (text.size() < kBlock) return;
    write(text);
    text.clear();
  });
  write(text);
}

}  // namespace lk::emulator
