#pragma once

/// Feeds lines of candump to the decoder and returns its output.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "tests/tools/reader_output.hpp"
#include "tools/decode/decoder.hpp"

namespace lk::emulator {

using Json = nlohmann::json;

inline DecodeOptions json_options(Generation generation = Generation::kLegacy,
                                  Series series = Series::kMf) {
  DecodeOptions options;
  options.generation = generation;
  options.profile.name = "test";
  options.profile.series = series;
  options.json = true;
  return options;
}

/// Returns the output for the lines; the last object is the summary.
inline std::vector<Json> decode(const std::vector<std::string>& lines,
                                const DecodeOptions& options = json_options()) {
  return test::json_lines(test::output_of(Decoder(options), lines));
}

inline std::string text(const std::vector<std::string>& lines, DecodeOptions options) {
  options.json = false;
  return test::output_of(Decoder(options), lines);
}

inline std::vector<std::string> roles(const std::vector<Json>& objects) {
  std::vector<std::string> words;
  for (const Json& one : objects) {
    if (one["type"] == "frame") words.push_back(one["role"]);
  }
  return words;
}

/// Returns the row of a command on the first interface.
inline Json tally(const std::vector<Json>& objects, int drive, std::string_view command) {
  for (const Json& one : objects.back()["buses"][0]["commands"]) {
    if (one["drive"] == drive && one["command"] == command) return one;
  }
  ADD_FAILURE() << "nothing of " << command;
  return {};
}

using Roles = std::vector<std::string>;

}  // namespace lk::emulator
