// Prints the codec's values of frames, for tests in Python. Reads lines "reply v236 MF
// 141#9A24081300000000"; writes one object per line with values by the names of the field table.

#include <cstdio>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>

#include "tests/support/frames.hpp"
#include "tests/tools/formats/codec_values.hpp"

namespace {

using namespace lk::protocol;

Dialect dialect_of(const std::string& generation) {
  for (const GenerationRow& row : kGenerationRows) {
    if (row.name == generation) return row.dialect;
  }
  throw std::invalid_argument("no generation: " + generation);
}

Series series_of(const std::string& name) {
  if (name == "MS") return Series::kMs;
  if (name == "MF") return Series::kMf;
  if (name == "MG") return Series::kMg;
  if (name == "MH") return Series::kMh;
  throw std::invalid_argument("no series: " + name);
}

lk::test::Values values_of(const std::string& line) {
  std::istringstream words(line);
  std::string direction;
  std::string generation;
  std::string series;
  std::string text;
  words >> direction >> generation >> series >> text;
  const WireFormat format = wire_format(dialect_of(generation), series_of(series));
  const Frame frame = lk::test::frame(text);
  if (direction == "query") return lk::test::query_values(frame, format);
  if (direction == "reply") return lk::test::reply_values(frame, format);
  throw std::invalid_argument("neither query nor reply: " + direction);
}

}  // namespace

int main() {
  try {
    for (std::string line; std::getline(std::cin, line);) {
      std::cout << nlohmann::json(values_of(line)).dump() << '\n';
    }
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "frame_values: %s\n", problem.what());
    return 1;
  }
  return 0;
}
