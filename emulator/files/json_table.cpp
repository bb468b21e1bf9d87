#include "emulator/files/json_table.hpp"

#include <cstdint>
#include <optional>
#include <set>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace lk::emulator {
namespace {

/// Limit for the keys of one object: Json compares each new key with all earlier ones.
constexpr std::size_t kMaxJsonKeys = 1000;

/// Shortens "[json.exception.parse_error.101] parse error at line 1, column 13: …" of the library
/// to the part after the first colon.
std::string short_reason(const std::string& text) {
  const std::size_t colon = text.find(": ");
  return colon == std::string::npos ? text : text.substr(colon + 2);
}

/// Rejects text that is nested too deeply, repeats a key, or has too many keys in an object. The
/// library's parser callback is too slow: with it, the library searches the whole list again
/// after each element.
class Shape : public nlohmann::json_sax<Json> {
 public:
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool start_object(std::size_t) override { return open(); }
  bool end_object() override { return close(); }
  bool start_array(std::size_t) override { return open(); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override {
    std::set<std::string>& keys = keys_.back();
    if (!keys.insert(name).second) throw JsonError(name, "is given twice");
    if (keys.size() > kMaxJsonKeys) {
      throw JsonError(name, "is one of more than " + std::to_string(kMaxJsonKeys) + " keys");
    }
    return true;
  }
  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception& problem) override {
    throw JsonError("byte " + std::to_string(position),
                    "not JSON: " + short_reason(problem.what()));
  }

 private:
  bool open() {
    if (keys_.size() >= std::size_t{kDeepestJson}) {
      throw JsonError("body", "is nested deeper than " + std::to_string(kDeepestJson) + " levels");
    }
    keys_.emplace_back();
    return true;
  }
  bool close() {
    keys_.pop_back();
    return true;
  }

  std::vector<std::set<std::string>> keys_;  // one set for each open object or list
};

/// Builds the table for a TableReader while the library parses the text.
class TableBuilder : public Shape {
 public:
  toml::table take() {
    if (!root_) throw JsonError("body", "must be a JSON object");
    return std::move(*root_);
  }
  bool null() override { return open_.empty() || refuse("null is not allowed; leave the key out"); }
  bool boolean(bool value) override { return add(value); }
  bool number_integer(number_integer_t value) override { return add(value); }
  bool number_unsigned(number_unsigned_t value) override {
    if (!std::in_range<std::int64_t>(value)) refuse("the number is too large");
    return add(static_cast<std::int64_t>(value));
  }
  bool number_float(number_float_t value, const string_t&) override { return add(value); }
  bool string(string_t& value) override { return add(std::move(value)); }
  bool key(string_t& name) override {
    open_.back().key = name;
    return Shape::key(name);
  }
  bool start_object(std::size_t size) override {
    open_.push_back({toml::table(), ""});
    return Shape::start_object(size);
  }
  bool start_array(std::size_t size) override {
    open_.push_back({toml::array(), ""});
    return Shape::start_array(size);
  }
  bool end_object() override { return close() && Shape::end_object(); }
  bool end_array() override { return close() && Shape::end_array(); }

 private:
  struct Level {
    std::variant<toml::table, toml::array> node;
    std::string key;  // last key that was read, if `node` is an object
  };

  bool close() {
    Level done = std::move(open_.back());
    open_.pop_back();
    return std::visit([this](auto& node) { return add(std::move(node)); }, done.node);
  }
  template <class Value>
  bool add(Value value) {
    if (open_.empty()) {
      if constexpr (std::is_same_v<Value, toml::table>) root_ = std::move(value);
    } else if (auto* const table = std::get_if<toml::table>(&open_.back().node)) {
      table->insert(open_.back().key, std::move(value));
    } else {
      std::get<toml::array>(open_.back().node).push_back(std::move(value));
    }
    return true;
  }
  /// Throws JsonError with the path of the present value: "load.list[2]".
  [[noreturn]] bool refuse(const std::string& reason) const {
    std::string path;
    for (const Level& level : open_) {
      if (const auto* const list = std::get_if<toml::array>(&level.node)) {
        path += "[" + std::to_string(list->size()) + "]";
      } else {
        path += (path.empty() ? "" : ".") + level.key;
      }
    }
    throw JsonError(path, reason);
  }

  std::optional<toml::table> root_;
  std::vector<Level> open_;
};

}  // namespace

Json parse_json(std::string_view text) {
  // The library parses without recursion, so deep text cannot overflow the stack before the check.
  Shape shape;
  Json::sax_parse(text, &shape);
  return Json::parse(text);
}

toml::table parse_json_table(std::string_view text) {
  TableBuilder builder;
  Json::sax_parse(text, &builder);
  return builder.take();
}

}  // namespace lk::emulator
