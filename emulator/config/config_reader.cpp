#include "emulator/config/config_reader.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <set>
#include <sstream>
#include <utility>

#include "emulator/config/config.hpp"

namespace lk::emulator {
namespace {

/// Returns the length of the TOML string at the start of `text`, quotes included. An unclosed
/// string, which the parser rejects, ends with its line or the input. A multi-line string may end
/// with up to two extra quotes.
std::size_t length_of_quoted(std::string_view text) {
  const char quote = text.front();
  const bool long_one = text.size() >= 3 && text[1] == quote && text[2] == quote;
  for (std::size_t n = long_one ? 3 : 1; n < text.size(); ++n) {
    if (text[n] == '\\' && quote == '"') {
      ++n;
    } else if (long_one && text.substr(n, 3) == text.substr(0, 3)) {
      n += 3;
      for (int more = 0; more < 2 && n < text.size() && text[n] == quote; ++more) ++n;
      return n;
    } else if (!long_one && (text[n] == quote || text[n] == '\n')) {
      return text[n] == '\n' ? n : n + 1;
    }
  }
  return text.size();
}

}  // namespace

std::optional<int> line_of_deep_key(std::string_view toml) {
  int line = 1;
  int parts = 1;
  while (!toml.empty()) {
    std::size_t length = 1;
    switch (toml.front()) {
      case '.':
        if (++parts > kMaxKeyParts) return line;
        break;
      case '"':
      case '\'':
        length = length_of_quoted(toml);
        break;
      case '#':
        length = std::min(toml.find('\n'), toml.size());
        break;
      case '\n':
      case '=':
      case ',':
      case '[':
      case ']':
      case '{':
      case '}':
        parts = 1;
        break;
      default:
        break;
    }
    line += static_cast<int>(std::ranges::count(toml.substr(0, length), '\n'));
    toml.remove_prefix(length);
  }
  return std::nullopt;
}

namespace {

std::string outside(const std::string& value, const std::string& min, const std::string& max) {
  return value + " is out of range (" + min + " to " + max + ")";
}

/// Returns the message for a word that is not allowed. It lists the allowed words; if they are
/// many, it only suggests a similar one.
std::string none_of(const std::string& word, const std::vector<std::string>& words) {
  constexpr std::size_t kShortList = 16;
  const std::string quoted = "\"" + word + "\"";
  if (words.size() <= kShortList) return quoted + " is not one of " + comma_list(words);
  const std::string meant = closest_match(word, words);
  return quoted + " is unknown" + (meant.empty() ? "" : ", did you mean " + meant + "?");
}

}  // namespace

toml::table parse_toml(const std::string& text, const std::string& file) {
  if (const auto line = line_of_deep_key(text)) {
    throw ConfigError(file, *line, "",
                      "a key of more than " + std::to_string(kMaxKeyParts) + " parts");
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

const toml::node* TableReader::find(const std::string& key) {
  read_keys_.push_back(key);
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
  std::ranges::replace(line, '\n', ' ');  // line breaks inside strings are escaped
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
  // A table that was not parsed from TOML text has no lines.
  const int line = source.path ? std::max(1, static_cast<int>(source.begin.line)) : 0;
  const std::string dot = path_.empty() || key.empty() ? "" : ".";
  throw ConfigError(source.path ? *source.path : file_, line, path_ + dot + key, reason);
}

std::optional<double> TableReader::number(const std::string& key, double min, double max) {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_number()) fail(key, "must be a number");
  const double value = *node->value<double>();
  // This form also rejects NaN.
  if (!(value >= min && value <= max))
    fail(key, outside(plain_number(value), plain_number(min), plain_number(max)));
  return value;
}

std::optional<std::int64_t> TableReader::integer(const std::string& key, std::int64_t min,
                                                 std::int64_t max) {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_integer()) fail(key, "must be a whole number");
  const std::int64_t value = *node->value<std::int64_t>();
  if (value < min || value > max) {
    fail(key, outside(std::to_string(value), std::to_string(min), std::to_string(max)));
  }
  return value;
}

std::optional<bool> TableReader::boolean(const std::string& key) {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_boolean()) fail(key, "must be true or false");
  return node->value<bool>();
}

std::optional<std::string> TableReader::text(const std::string& key) {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_string()) fail(key, "must be a string");
  return node->value<std::string>();
}

std::vector<std::string> TableReader::texts(const std::string& key) {
  std::vector<std::string> all;
  const toml::node* node = find(key);
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
  const toml::node* node = find(key);
  if (node == nullptr) return all;
  const std::string wanted = "must be an array of " + std::to_string(count) + " numbers";
  if (!node->is_array() || node->as_array()->size() != count) fail(key, wanted);
  for (const toml::node& element : *node->as_array()) {
    if (!element.is_number()) fail(key, wanted);
    const double value = *element.value<double>();
    if (!(value >= min && value <= max))
      fail(key, outside(plain_number(value), plain_number(min), plain_number(max)));
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
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_table()) fail(key, "must be a table");
  return TableReader(*node->as_table(), file_, path_.empty() ? key : path_ + "." + key);
}

std::vector<TableReader> TableReader::tables(const std::string& key) {
  std::vector<TableReader> readers;
  const toml::node* node = find(key);
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
    if (std::find(read_keys_.begin(), read_keys_.end(), name) != read_keys_.end()) continue;
    const std::string meant = closest_match(name, read_keys_);
    fail(name, meant.empty() ? "unknown key" : "unknown key, did you mean " + meant + "?");
  }
  if (!missing_.empty()) fail(missing_.front(), "missing");
}

namespace {

/// Parses an ID as a decimal number without other characters. Throws std::invalid_argument.
int parse_id(const std::string& text) {
  int id = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id);
  const bool whole = end == text.data() + text.size() && !text.empty();
  if (error == std::errc::result_out_of_range) id = kMaxId + 1;
  if (!whole) throw std::invalid_argument("\"" + text + "\" is not an ID; write 1-4 or 1,3,7-9");
  if (id < 1 || id > kMaxId) {
    throw std::invalid_argument("ID " + text + " is outside 1.." + std::to_string(kMaxId));
  }
  return id;
}

}  // namespace

std::vector<int> parse_ids(const std::string& text) {
  std::set<int> ids;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t comma = std::min(text.find(',', start), text.size());
    const std::string part = text.substr(start, comma - start);
    const std::size_t dash = part.find('-');
    const int first = parse_id(part.substr(0, dash));
    const int last = dash == std::string::npos ? first : parse_id(part.substr(dash + 1));
    if (last < first) throw std::invalid_argument("the range " + part + " runs backwards");
    for (int id = first; id <= last; ++id) {
      if (!ids.insert(id).second) {
        throw std::invalid_argument("ID " + std::to_string(id) + " is given twice");
      }
    }
    start = comma + 1;
  }
  return {ids.begin(), ids.end()};
}

std::vector<int> read_ids(TableReader& reader) {
  const auto id = reader.integer("id", 1, kMaxId);
  const auto ids = reader.text("ids");
  if (id && ids) reader.fail("ids", "give either id or ids");
  if (id) return {static_cast<int>(*id)};
  if (!ids) return {};
  try {
    return parse_ids(*ids);
  } catch (const std::invalid_argument& problem) {
    reader.fail("ids", problem.what());
  }
}

}  // namespace lk::emulator
