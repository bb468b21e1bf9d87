#include "emulator/body/mujoco_numbers.hpp"

#include <mujoco/mjxmacro.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <type_traits>
#include <vector>

namespace lk::emulator {
namespace {

struct Attribute {
  std::string_view element, name, value;
};

constexpr auto npos = std::string_view::npos;

/// Returns all attributes of well-formed XML; MuJoCo reports errors in other text.
std::vector<Attribute> attributes_of(std::string_view text) {
  std::vector<Attribute> all;
  std::string_view element;
  constexpr const char* kEnds = " \t\r\n/>=";
  for (std::size_t at = 0; (at = text.find_first_of("<\"'", at)) != npos;) {
    if (text.substr(at).starts_with("<!--")) {
      at = text.find("-->", at);
    } else if (text[at] == '<') {
      element = text.substr(at + 1, text.find_first_of(kEnds, at + 1) - at - 1);
      ++at;
    } else {
      const std::size_t end = text.find(text[at], at + 1);
      const std::size_t equals = text.find_last_not_of(" \t\r\n", at - 1);
      if (end == npos || equals == npos || text[equals] != '=') return all;
      const std::size_t last = text.find_last_not_of(" \t\r\n", equals - 1);
      const std::size_t first = text.find_last_of(" \t\r\n", last) + 1;
      all.push_back(
          {element, text.substr(first, last + 1 - first), text.substr(at + 1, end - at - 1)});
      at = end + 1;
    }
  }
  return all;
}

/// Returns true if all words are numbers, unlike a name, and one is not finite.
bool has_odd_number(std::string_view value) {
  std::istringstream words{std::string(value)};
  bool odd = false;
  for (std::string word; words >> word;) {
    char* end = nullptr;
    odd = !std::isfinite(std::strtod(word.c_str(), &end)) || odd;
    if (*end != '\0') return false;
  }
  return odd;
}

template <class Number>
void check_finite(std::span<const Number> values, const std::string& file, const char* name) {
  if constexpr (std::is_floating_point_v<Number>) {
    const auto wrong =
        std::ranges::find_if(values, [](Number value) { return !std::isfinite(value); });
    if (wrong == values.end()) return;
    throw std::invalid_argument(file + ": " + name + "[" + std::to_string(wrong - values.begin()) +
                                "] is not a finite number");
  }
}

}  // namespace

void check_written_numbers(const std::string& file) {
  // Includes are relative to the model's own directory (MuJoCo, XML reference).
  const auto directory = std::filesystem::path(file).parent_path();
  std::vector<std::filesystem::path> left{file};
  std::set<std::filesystem::path> seen;
  while (!left.empty()) {
    const std::filesystem::path one = left.back();
    left.pop_back();
    if (!seen.insert(one).second) continue;
    std::ostringstream text;
    text << std::ifstream(one).rdbuf();
    const std::string held = text.str();
    for (const auto& [element, name, value] : attributes_of(held)) {
      if (element == "include" && name == "file") left.push_back(directory / value);
      if (name == "name" || !has_odd_number(value)) continue;
      throw std::invalid_argument(one.string() + ": " + std::string(name) + "=\"" +
                                  std::string(value) + "\" is not a finite number");
    }
  }
}

void check_model_numbers(const mjModel& model, const std::string& file) {
#define X(type, name) check_finite<type>({&model.opt.name, 1}, file, #name);
  MJOPTION_FLOATS
#undef X
#define X(name, size) check_finite<mjtNum>({&model.opt.name[0], size}, file, #name);
  MJOPTION_VECTORS
#undef X
#undef MJ_M
#define MJ_M(size) model.size
#define X(type, name, rows, columns)                                                          \
  check_finite<type>(                                                                         \
      {model.name, static_cast<std::size_t>(model.rows) * static_cast<std::size_t>(columns)}, \
      file, #name);
  MJMODEL_POINTERS
#undef X
}

}  // namespace lk::emulator
