#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "emulator/ground/start_error.hpp"
#include "tests/support/temp_directory.hpp"
#include "tests/tools/campaign/results/synthetic.hpp"
#include "tools/campaign/results/campaign_store.hpp"
#include "tools/campaign/results/canonical.hpp"

namespace lk::test {

/// What `act` is refused with, which has to be one line; "": it is not.
template <class Act>
std::string refused(Act&& act) {
  try {
    act();
  } catch (const emulator::StartError& error) {
    const std::string line = error.what();
    EXPECT_FALSE(line.empty());
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
    return line;
  }
  return "";
}

inline std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline std::string exported(const std::filesystem::path& path) {
  std::string text;
  export_canonical(emulator::CampaignStore::read(path),
                   [&](std::string_view part) { text += part; });
  return text;
}

/// Of cases without a file.
inline std::string canonical(const emulator::CampaignHead& head,
                             const std::vector<emulator::CaseResult>& cases) {
  std::string text = emulator::canonical_header(head);
  for (const auto& one : cases) text += emulator::canonical_line(one);
  return text;
}

}  // namespace lk::test
