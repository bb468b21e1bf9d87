#pragma once

#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

namespace lk::test {

/// Returns all that a reader of candump's lines prints.
template <class Reader>
std::string output_of(Reader reader, const std::vector<std::string>& lines) {
  std::string out;
  for (const std::string& line : lines) out += reader.take(line);
  return out + reader.finish();
}

/// Parses one JSON object per line.
inline std::vector<nlohmann::json> json_lines(const std::string& text) {
  std::vector<nlohmann::json> objects;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    objects.push_back(nlohmann::json::parse(line));
  }
  return objects;
}

}  // namespace lk::test
