// The example file has every key that docs/reference/configuration.md and docs/reference/events.md
// list, and the documents explain every key of the example.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "emulator/config/config_reader.hpp"
#include "emulator/config/profile_fields.hpp"
#include "emulator/config/register_fields.hpp"

namespace lk::emulator {
namespace config_documents_test {

const std::string kRoot = LKEMU_SOURCE_DIR;

std::string text_of(const std::string& file) {
  std::ostringstream text;
  text << std::ifstream(kRoot + "/" + file).rdbuf();
  return text.str();
}

/// Collects the last parts of all dotted keys.
void collect(const toml::node& node, std::set<std::string>& keys) {
  if (const auto* table = node.as_table()) {
    for (const auto& [key, value] : *table) {
      keys.insert(std::string(key.str()));
      collect(value, keys);
    }
  } else if (const auto* array = node.as_array()) {
    for (const auto& element : *array) collect(element, keys);
  }
}

std::set<std::string> keys_of_example() {
  std::set<std::string> keys;
  const toml::table document = parse_toml(text_of("configs/buses/example.toml"), "example.toml");
  collect(document, keys);
  return keys;
}

/// Returns the keys in the first column of the tables, last part only.
std::set<std::string> documented_keys() {
  const std::string file = text_of("docs/reference/configuration.md");
  const std::string events = text_of("docs/reference/events.md");
  std::istringstream lines(file.substr(0, file.find("\n## Motor files")) +
                           events.substr(0, events.find("\n## Conditions")));
  const std::regex quoted("`([^`]+)`");
  std::set<std::string> keys;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("| `")) continue;
    const std::string cell = line.substr(1, line.find('|', 1) - 1);
    for (std::sregex_iterator key(cell.begin(), cell.end(), quoted), end; key != end; ++key) {
      std::string name = (*key)[1];
      name.erase(
          std::remove_if(name.begin(), name.end(), [](char c) { return c == '[' || c == ']'; }),
          name.end());
      keys.insert(name.substr(name.rfind('.') + 1));
    }
  }
  return keys;
}

// Placeholders for several keys.
const std::set<std::string> kPlaceholders{"SECTION", "threshold_U", "hysteresis_U"};

TEST(ConfigDocuments, TheExampleHasEveryKey) {
  const auto example = keys_of_example();
  const auto documented = documented_keys();
  EXPECT_GT(documented.size(), 60U);
  for (const auto& key : documented) {
    EXPECT_TRUE(kPlaceholders.contains(key) || example.contains(key)) << key;
  }
}

TEST(ConfigDocuments, EveryKeyOfTheExampleIsExplained) {
  const std::string document =
      text_of("docs/reference/configuration.md") + text_of("docs/reference/events.md");
  const std::regex with_unit("(threshold|hysteresis)_[VCAs]");
  for (const auto& key : keys_of_example()) {
    if (std::regex_match(key, with_unit)) continue;
    const std::regex in_code("`[^`\\n]*\\b" + key + "\\b[^`\\n]*`");
    EXPECT_TRUE(std::regex_search(document, in_code)) << key;
  }
}

// Checks against the sources: this finds keys that neither the example nor a document has.
TEST(ConfigDocuments, EveryKeyOfTheSourceIsExplained) {
  std::string documents;
  for (const char* name :
       {"reference/configuration", "reference/events", "guides/scenarios", "guides/robots"}) {
    documents += text_of(std::string("docs/") + name + ".md");
  }
  // reader.number("key", …), read_word(reader, "key", …), and rows {"key", &Section::member}.
  const std::regex asked(
      R"re((?:\.|->)(?:number|integer|boolean|text|choice|tables?)\(\s*"(\w+)")re"
      R"re(|\(\*?reader, "(\w+)"|\n *\{"(\w+)", &)re");
  std::set<std::string> keys;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(kRoot + "/emulator/config")) {
    const std::string name = entry.path().filename();
    if (!name.starts_with("config") || !name.ends_with(".cpp")) continue;
    const std::string source = text_of(std::filesystem::relative(entry.path(), kRoot));
    for (std::sregex_iterator key(source.begin(), source.end(), asked), end; key != end; ++key) {
      keys.insert((*key)[1].str() + (*key)[2].str() + (*key)[3].str());
    }
  }
  EXPECT_GT(keys.size(), 80U);
  for (const auto& key : keys) {
    const std::regex in_code("`[^`\\n]*\\b" + key + "\\b[^`\\n]*`|\\n" + key + " = ");
    EXPECT_TRUE(std::regex_search(documents, in_code)) << key;
  }
}

// The last column of the table of differences names keys of [quirks].
TEST(ConfigDocuments, ProtocolNamesExistingSwitches) {
  const std::string all = text_of("docs/reference/protocol.md");
  const std::size_t begin = all.find("\n### 10.1 ");
  ASSERT_NE(begin, std::string::npos);
  std::istringstream lines(all.substr(begin, all.find("\n### 10.2 ") - begin));
  const auto example = keys_of_example();
  const std::regex last_cell(R"(^\|.*\| `([^`|]+)` \|$)");
  std::size_t rows = 0;
  bool generated = false;  // command_page_test checks that part
  for (std::string line; std::getline(lines, line);) {
    std::smatch cell;
    if (line.starts_with("<!-- begin")) generated = true;
    if (line.starts_with("<!-- end")) generated = false;
    if (generated) continue;
    if (!line.starts_with("| ") || line.ends_with("| switch |")) continue;
    ASSERT_TRUE(std::regex_match(line, cell, last_cell)) << line;
    EXPECT_TRUE(example.contains(cell[1])) << line;
    ++rows;
  }
  EXPECT_GT(rows, 0U);
}

TEST(ConfigDocuments, EveryRegisterIsExplained) {
  const auto documented = documented_keys();
  for (const auto& field : profile_fields::kRegisters) {
    EXPECT_TRUE(documented.contains(field.key)) << field.key;
  }
  for (const auto& field : profile_fields::kWideGains) {
    EXPECT_TRUE(documented.contains(field.key)) << field.key;
  }
  for (const auto& field : profile_fields::kLoad) {
    EXPECT_TRUE(documented.contains(field.key)) << field.key;
  }
  for (const auto& kind : profile_fields::kProtections) {
    EXPECT_TRUE(documented.contains(kind.name)) << kind.name;
  }
}

}  // namespace config_documents_test
}  // namespace lk::emulator
