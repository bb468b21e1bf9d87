// The documents about directives and faults agree with the program.

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/servo/signals.hpp"
#include "emulator/io/program/config_listing.hpp"
#include "tests/emulator/config/config_support.hpp"
#include "tools/commands/faults_command.hpp"

namespace lk::emulator {
namespace fault_listing_test {

std::string document(const std::string& name) {
  std::ostringstream text;
  text << std::ifstream(std::string(LKEMU_SOURCE_DIR) + "/docs/" + name).rdbuf();
  EXPECT_FALSE(text.str().empty()) << name;
  return text.str();
}

/// Returns the text between the markers of a generated part.
std::string generated(const std::string& text, const std::string& what) {
  const std::string begin = "<!-- begin " + what + " -->\n";
  const std::size_t first = text.find(begin);
  const std::size_t last = text.find("<!-- end " + what + " -->");
  if (first == std::string::npos || last == std::string::npos) return "no markers";
  return text.substr(first + begin.size(), last - first - begin.size());
}

/// Returns the TOML blocks of a document.
std::vector<std::string> examples(const std::string& text) {
  const std::string fence = "```toml\n";
  std::vector<std::string> blocks;
  for (std::size_t at = text.find(fence); at != std::string::npos; at = text.find(fence, at + 1)) {
    const std::size_t begin = at + fence.size();
    blocks.push_back(text.substr(begin, text.find("```", begin) - begin));
  }
  return blocks;
}

const std::string kBus = "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nids = \"1-4\"\n";
const std::string kAdapterBus =
    "[[bus]]\ninterface = \"vcan0\"\nadapter = \"usb_can\"\n[[bus.drive]]\nids = \"1-4\"\n";
const std::string kSerialBus =
    "[[bus]]\ninterface = \"rs485:/tmp/a\"\n[[bus.drive]]\nids = \"1-4\"\n";

TEST(Documents, FaultsMatchTheTable) {
  EXPECT_EQ(generated(document("reference/events.md"), "faults"), fault_page())
      << "put what `lk-emu faults --markdown` prints between the markers";
}

TEST(Documents, SignalsMatchTheTable) {
  std::string table = "| signal | what |\n|---|---|\n";
  for (const Signal& signal : signals()) {
    table += "| `" + std::string(signal.name) + "` | " + std::string(signal.about) + " |\n";
  }
  EXPECT_EQ(generated(document("reference/events.md"), "signals"), table);
}

TEST(Documents, BodySignalsMatchTheTable) {
  std::string table = "| signal | what |\n|---|---|\n";
  for (const BodySignal& signal : body_signal_table()) {
    const std::string name = (signal.of_part ? "body.PART." : "body.") + std::string(signal.name);
    table += "| `" + name + "` | " + std::string(signal.about) + " |\n";
  }
  EXPECT_EQ(generated(document("reference/events.md"), "body signals"), table);
}

TEST(Documents, ExamplesAreAccepted) {
  const auto blocks = examples(document("reference/events.md"));
  EXPECT_GT(blocks.size(), 1U);
  for (const std::string& block : blocks) {
    EXPECT_NO_THROW({
      try {
        EXPECT_FALSE(parse(kBus + block)[0].events.empty()) << block;
      } catch (const ConfigError& error) {
        ADD_FAILURE() << error.what() << "\n" << block;
      }
    });
  }
}

TEST(FaultListing, ShowsAValidExampleOfEveryKind) {
  const std::string list = list_faults();
  for (const FaultRow& row : fault_table()) {
    EXPECT_NE(list.find("  " + std::string(row.word) + " "), std::string::npos) << row.word;
    const std::string page = describe_fault(row);
    EXPECT_NE(page.find(row.about.en), std::string::npos);
    const std::string marker = "as an event of a configuration or scenario:\n";
    const std::string example = page.substr(page.find(marker) + marker.size());
    // These drives have no gear or brake.
    if (row.word == "backlash" || row.word == "brake_late") continue;
    const std::string bus = row.serial                      ? kSerialBus
                            : row.word == "adapter_overrun" ? kAdapterBus
                                                            : kBus;
    EXPECT_NO_THROW(parse(bus + "[[bus.event]]\n" + example)) << example;
  }
}

TEST(ConfigListing, CountsTheFaultsOfADriveAmongItsEvents) {
  const std::string listing = describe_run(
      parse(kBus + "[[bus.event]]\nat_s = 1\nids = \"2,3\"\nfault = \"jam\"\n[[bus.event]]\nat_s = "
                   "1\nid = 3\npower = \"cycle\"\n[[bus.event]]\nat_s = 2\nclear = \"jam\"\n"));
  EXPECT_NE(listing.find("4 drives, 3 events"), std::string::npos) << listing;
  // The column before the load, which is empty.
  const auto events_of = [&](int id) {
    std::istringstream lines(listing);
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      std::vector<std::string> row{std::istream_iterator<std::string>(words), {}};
      if (!row.empty() && row[0] == std::to_string(id)) return row[row.size() - 2];
    }
    return std::string("no row");
  };
  EXPECT_EQ(events_of(1), "-");
  EXPECT_EQ(events_of(2), "1");
  EXPECT_EQ(events_of(3), "2");
}

}  // namespace fault_listing_test
}  // namespace lk::emulator
