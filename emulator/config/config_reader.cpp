#include "emulator/config/config_reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <sstream>
#include <utility>

#include "emulator/config/toml_depth.hpp"

namespace lk::emulator {
namespace {

/// Letters to be added, left out or replaced, and neighbours to be swapped (optimal string
/// alignment).
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> before;  // the row before the last
  std::vector<std::size_t> last(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::vector<std::size_t> row{i};
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row.push_back(std::min({last[j] + 1, row[j - 1] + 1, replaced}));
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], before[j - 2] + 1);
      }
    }
    before = std::move(last);
    last = std::move(row);
  }
  return last[b.size()];
}

std::string print(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.10g", value);
  return buffer;
}

std::string outside(const std::string& value, const std::string& min, const std::string& max) {
  return value + " is out of range (" + min + " to " + max + ")";
}

/// Long lists are looked up elsewhere.
std::string none_of(const std::string& word, const std::vector<std::string>& words) {
  constexpr std::size_t kShortList = 16;
  const std::string quoted = "\"" + word + "\"";
  if (words.size() <= kShortList) return quoted + " is not one of " + comma_list(words);
  const std::string meant = nearest(word, words);
  return quoted + " is unknown" + (meant.empty() ? "" : ", did you mean " + meant + "?");
}

}  // namespace

std::string comma_list(const std::vector<std::string>& words) {
  std::string all;
  for (const auto& word : words) all += (all.empty() ? "" : ", ") + word;
  return all;
}

std::string nearest(const std::string& word, const std::vector<std::string>& known) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const auto& candidate : known) {
    // The unit is what people forget: max_speed for max_speed_dps.
    const bool cut_short = word.size() >= 3 && candidate.starts_with(word);
    const std::size_t distance = cut_short ? 1 : edit_distance(word, candidate);
    if (distance < best_distance) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

toml::table parse_toml(const std::string& text, const std::string& file) {
  if (const auto line = line_of_deep_key(text)) {
    throw ConfigError(file, *line, "",
                      "a key of more than " + std::to_string(kMostKeyParts) + " parts");
  }
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    throw ConfigError(file, static_cast<int>(error.source().begin.line), "",
                      std::string(error.description()));
  }
}

TableReader::TableReader(const toml::table& table, std::string file, std::string path)
    : table_(&table), file_(std::move(file)), path_(std::move(path)) {}

const toml::node* TableReader::ask(const std::string& key) {
  asked_.push_back(key);
  return table_->get(key);
}

bool TableReader::has(const std::string& key) const { return table_->contains(key); }

bool TableReader::is_text(const std::string& key) const {
  const toml::node* node = table_->get(key);
  return node != nullptr && node->is_string();
}

bool TableReader::is_integer(const std::string& key) const {
  const toml::node* node = table_->get(key);
  return node != nullptr && node->is_integer();
}

std::string TableReader::as_json(const std::vector<std::string>& without) const {
  toml::table table = *table_;
  for (const std::string& key : without) table.erase(key);
  std::ostringstream text;
  text << toml::json_formatter{table, toml::format_flags::none};
  std::string line = text.str();
  std::ranges::replace(line, '\n', ' ');  // a line break within a string is an escape
  return line;
}

void TableReader::fail(const std::string& key, const std::string& reason) const {
  const toml::node* node = table_->get(key);
  const auto& source = node != nullptr ? node->source() : table_->source();
  fail_at(source, key, reason);
}

void TableReader::fail_together(const std::vector<std::string>& keys,
                                const std::string& reason) const {
  const toml::source_region* place = &table_->source();
  for (const std::string& key : keys) {
    const toml::node* node = table_->at_path(key).node();
    if (node == nullptr) continue;
    place = &node->source();
    if (place->path && *place->path == file_) break;
  }
  fail_at(*place, keys.front(), reason);
}

void TableReader::fail_at(const toml::source_region& source, const std::string& key,
                          const std::string& reason) const {
  // A table that was not read from a text has no lines.
  const int line = source.path ? std::max(1, static_cast<int>(source.begin.line)) : 0;
  const std::string dot = path_.empty() || key.empty() ? "" : ".";
  throw ConfigError(source.path ? *source.path : file_, line, path_ + dot + key, reason);
}

std::optional<double> TableReader::number(const std::string& key, double min, double max) {
  const toml::node* node = ask(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_number()) fail(key, "must be a number");
  const double value = *node->value<double>();
  // Written so that "not a number" fails too.
  if (!(value >= min && value <= max)) fail(key, outside(print(value), print(min), print(max)));
  return value;
}

std::optional<std::int64_t> TableReader::integer(const std::string& key, std::int64_t min,
                                                 std::int64_t max) {
  const toml::node* node = ask(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_integer()) fail(key, "must be a whole number");
  const std::int64_t value = *node->value<std::int64_t>();
  if (value < min || value > max) {
    fail(key, outside(std::to_string(value), std::to_string(min), std::to_string(max)));
  }
  return value;
}

std::optional<bool> TableReader::boolean(const std::string& key) {
  const toml::node* node = ask(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_boolean()) fail(key, "must be true or false");
  return node->value<bool>();
}

std::optional<std::string> TableReader::text(const std::string& key) {
  const toml::node* node = ask(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_string()) fail(key, "must be a string");
  return node->value<std::string>();
}

std::vector<std::string> TableReader::texts(const std::string& key) {
  std::vector<std::string> all;
  const toml::node* node = ask(key);
  if (node == nullptr) return all;
  if (!node->is_array()) fail(key, "must be an array of strings");
  for (const toml::node& element : *node->as_array()) {
    if (!element.is_string()) fail(key, "must be an array of strings");
    all.push_back(*element.value<std::string>());
  }
  return all;
}

std::vector<double> TableReader::numbers(const std::string& key, std::size_t count, double min,
                                         double max) {
  std::vector<double> all;
  const toml::node* node = ask(key);
  if (node == nullptr) return all;
  const std::string wanted = "must be an array of " + std::to_string(count) + " numbers";
  if (!node->is_array() || node->as_array()->size() != count) fail(key, wanted);
  for (const toml::node& element : *node->as_array()) {
    if (!element.is_number()) fail(key, wanted);
    const double value = *element.value<double>();
    if (!(value >= min && value <= max)) fail(key, outside(print(value), print(min), print(max)));
    all.push_back(value);
  }
  return all;
}

std::optional<std::size_t> TableReader::choice(const std::string& key,
                                               const std::vector<std::string>& words) {
  const auto word = text(key);
  if (!word) return std::nullopt;
  const auto found = std::find(words.begin(), words.end(), *word);
  if (found == words.end()) fail(key, none_of(*word, words));
  return static_cast<std::size_t>(found - words.begin());
}

std::optional<TableReader> TableReader::table(const std::string& key) {
  const toml::node* node = ask(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_table()) fail(key, "must be a table");
  return TableReader(*node->as_table(), file_, path_.empty() ? key : path_ + "." + key);
}

std::vector<TableReader> TableReader::tables(const std::string& key) {
  std::vector<TableReader> readers;
  const toml::node* node = ask(key);
  if (node == nullptr) return readers;
  if (!node->is_array_of_tables()) fail(key, "must be an array of tables, [[" + key + "]]");
  for (const auto& element : *node->as_array()) {
    readers.emplace_back(*element.as_table(), file_, path_.empty() ? key : path_ + "." + key);
  }
  return readers;
}

void TableReader::finish() const {
  for (const auto& [key, node] : *table_) {
    const std::string name(key.str());
    if (std::find(asked_.begin(), asked_.end(), name) != asked_.end()) continue;
    const std::string meant = nearest(name, asked_);
    fail(name, meant.empty() ? "unknown key" : "unknown key, did you mean " + meant + "?");
  }
  if (!missing_.empty()) fail(missing_.front(), "missing");
}

}  // namespace lk::emulator
