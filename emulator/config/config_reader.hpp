#pragma once

#include <toml++/toml.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "emulator/config/config_error.hpp"
#include "emulator/core/text.hpp"

namespace lk::emulator {

/// Limit for the parts of a key "a.b.c"; no file here needs more.
inline constexpr int kMaxKeyParts = 32;

/// Returns the line (from 1) of the first key with more than kMaxKeyParts parts. The parser nests
/// one table per part; the destructors of very deep tables would overflow the stack.
std::optional<int> line_of_deep_key(std::string_view toml);

/// Parses `text` as TOML. Throws ConfigError with the line of the error.
toml::table parse_toml(const std::string& text, const std::string& file);

/// Reads one table strictly: each value has a type and a range, and `finish()` rejects keys that
/// were not read. All methods throw ConfigError.
class TableReader {
 public:
  /// `path` is the dotted key of the table, empty at the top. The table must outlive the reader. An
  /// error in a value that was inherited from another file (`extends`) names that file.
  TableReader(const toml::table& table, std::string file, std::string path);

  // Absent keys return nullopt; a wrong type or a value outside [min, max] is an error.
  std::optional<double> number(const std::string& key, double min, double max);
  std::optional<std::int64_t> integer(const std::string& key, std::int64_t min, std::int64_t max);
  std::optional<bool> boolean(const std::string& key);
  std::optional<std::string> text(const std::string& key);
  /// Reads an array of strings; empty if absent.
  std::vector<std::string> texts(const std::string& key);
  /// Reads an array of `count` numbers; empty if absent.
  std::vector<double> numbers(const std::string& key, std::size_t count, double min, double max);
  /// Reads a string that must be one of `words`; returns its index.
  std::optional<std::size_t> choice(const std::string& key, const std::vector<std::string>& words);
  std::optional<TableReader> table(const std::string& key);
  /// Reads `[[key]]`, an array of tables; empty if absent.
  std::vector<TableReader> tables(const std::string& key);

  const std::string& file() const { return file_; }
  bool has(const std::string& key) const;
  /// Keys read so far.
  const std::vector<std::string>& read_keys() const { return read_keys_; }
  bool is_text(const std::string& key) const;
  bool is_integer(const std::string& key) const;
  /// Returns the table as JSON on one line, without the keys `without`.
  std::string as_json(const std::vector<std::string>& without) const;
  /// Makes `finish()` fail with "missing". Does not fail at once, so that `finish()` can first
  /// report a misspelt key as such.
  void note_missing(const std::string& key) { missing_.push_back(key); }
  /// Returns the `value` read at `key`; if it is absent, notes it as missing and returns a default.
  template <typename Value>
  Value required(const std::string& key, std::optional<Value> value) {
    if (!value) note_missing(key);
    return std::move(value).value_or(Value{});
  }
  /// Fails at the line of `key`; at the line of the table if `key` is absent or empty.
  [[noreturn]] void fail(const std::string& key, const std::string& reason) const;
  /// Fails because `keys` (dotted) conflict: names the first key, at the line of the first one that
  /// this file states itself instead of inheriting it.
  [[noreturn]] void fail_together(const std::vector<std::string>& keys,
                                  const std::string& reason) const;
  /// Call after all reads: rejects unknown keys, then missing ones.
  void finish() const;

 private:
  const toml::node* find(const std::string& key);
  [[noreturn]] void fail_at(const toml::source_region& source, const std::string& key,
                            const std::string& reason) const;

  const toml::table* table_;
  std::string file_;
  std::string path_;
  std::vector<std::string> read_keys_;
  std::vector<std::string> missing_;
};

/// Reads the keys `id` or `ids` of a table; ascending, empty if both are absent.
std::vector<int> read_ids(TableReader& reader);

/// Returns which of the two keys is present, for messages.
inline const char* ids_key(const TableReader& reader) { return reader.has("ids") ? "ids" : "id"; }

/// Whether a value is required in a file.
enum class Presence : std::uint8_t { kRequired, kOptional };

/// One row of a mapping: key of the file ↔ member of the struct, unit of the key, range.
template <typename Section>
struct Field {
  using Member = std::variant<double Section::*, std::int32_t Section::*, std::uint16_t Section::*,
                              std::uint8_t Section::*, bool Section::*>;
  const char* key;
  Member member;
  double unit = 1;  // value of the member for 1 in the file
  double min = 0;   // in units of the file
  double max = 0;
  bool may_lack = false;  // true: even a file with required values may lack it
};

/// Reads `fields` into `section`. The member of an absent key keeps its value.
template <typename Section>
void read_fields(TableReader& reader, std::span<const Field<Section>> fields, Presence presence,
                 Section& section) {
  const auto read = [&](const Field<Section>& field, auto member) {
    using Value = std::remove_reference_t<decltype(section.*member)>;
    if constexpr (std::is_same_v<Value, bool>) {
      const auto value = reader.boolean(field.key);
      if (value) section.*member = *value;
      return value.has_value();
    } else if constexpr (std::is_same_v<Value, double>) {
      const auto value = reader.number(field.key, field.min, field.max);
      if (value) section.*member = *value * field.unit;
      return value.has_value();
    } else {
      const auto value = reader.integer(field.key, static_cast<std::int64_t>(field.min),
                                        static_cast<std::int64_t>(field.max));
      if (value) section.*member = static_cast<Value>(*value);
      return value.has_value();
    }
  };
  for (const auto& field : fields) {
    const bool found = std::visit([&](auto member) { return read(field, member); }, field.member);
    if (!found && presence == Presence::kRequired && !field.may_lack)
      reader.note_missing(field.key);
  }
}

/// Reads the fields of the table `name`, which may be absent if they are optional.
template <typename Section, std::size_t kCount>
void read_section(TableReader& reader, const char* name, const Field<Section> (&fields)[kCount],
                  Presence presence, Section& section) {
  auto table = reader.table(name);
  if (!table) {
    if (presence == Presence::kRequired) reader.note_missing(name);
    return;
  }
  read_fields<Section>(*table, fields, presence, section);
  table->finish();
}

}  // namespace lk::emulator
