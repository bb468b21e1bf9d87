// Every list that a client can lengthen has an end, and docs/reliability.md says which.

#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <map>
#include <string>

#include "emulator/control/control_directives.hpp"
#include "emulator/control/frame_stream.hpp"
#include "emulator/control/telemetry_stream.hpp"
#include "emulator/core/wire/can_wire.hpp"
#include "emulator/program/scenario_activity.hpp"
#include "emulator/record/log_writer.hpp"
#include "tests/emulator/control/control_support.hpp"

namespace lk::emulator {
namespace bounds_test {

/// What the table of the document says, by the name of the list.
std::map<std::string, std::string> documented() {
  std::map<std::string, std::string> bounds;
  std::ifstream page(LKEMU_SOURCE_DIR "/docs/reliability.md");
  bool in_table = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("| what a client can lengthen |")) in_table = true;
    if (line.empty()) in_table = false;
    if (!in_table || !line.starts_with("| ") || line.starts_with("| what ")) continue;
    const std::size_t name_end = line.find(" |", 2);
    const std::size_t bound = line.find("| ", line.find("| ", name_end) + 2) + 2;
    bounds[line.substr(2, name_end - 2)] = line.substr(bound, line.find(" |", bound) - bound);
  }
  return bounds;
}

struct List {
  double bound;
  const char* longer;  // the request that makes it longer by one; none: other tests do
  const char* path = "/directives";
};

const std::map<std::string, List> kLists = {
    {"faults", {Bus::kMostFaults, R"({"id": 1, "fault": "reset"})"}},
    {"conditions",
     {Bus::kMostWaiting,
      R"({"id": 1, "turn_deg": 1, "when": {"signal": "speed_dps", "above": 1e9}})"}},
    {"planned directives", {kMostPlanned, R"({"id": 1, "turn_deg": 1, "at_s": 3600})"}},
    {"settings for the flash",
     {CanWire::kDriveQueue, R"({"id": 1, "settings": {"max_speed_dps": 100}})"}},
    {"frames for the wire", {CanWire::kHostQueue, R"({"command": "state_2", "id": 1})", "/frames"}},
    {"connections", {kMostConnections, nullptr}},
    {"WebSockets", {kMostStreams, nullptr}},
    {"streams of frames", {kMostFrameStreams, nullptr}},
    {"frames for a reader", {kMostGathered, nullptr}},
    {"bytes of samples for a reader", {kMostQueued, nullptr}},
    {"values of telemetry a second", {kMostTelemetryOfAll, nullptr}},
    {"frames while time stands still", {Line::kMostBacklog, nullptr}},
    {"bytes of a header", {kLongestHeader, nullptr}},
    {"bytes of a body", {kLongestBody, nullptr}},
    {"levels of JSON", {kDeepestJson, nullptr}},
    {"bytes of a message", {kLongestMessage, nullptr}},
    {"bytes of a scenario", {ScenarioActivity::kLongestFile, nullptr}},
    {"bytes for the disk", {LogWriter::kMostWaiting, nullptr}},
};

TEST(Bounds, AreThoseOfTheDocument) {
  std::map<std::string, std::string> real;
  for (const auto& [name, list] : kLists) {
    real[name] = std::to_string(static_cast<std::uint64_t>(list.bound));
  }
  EXPECT_EQ(documented(), real);
}

TEST(Bounds, EachListOfABusEndsThere) {
  for (const auto& [name, list] : kLists) {
    if (list.longer == nullptr) continue;
    TestWorld t;
    for (double n = 0; n < list.bound; ++n) {
      ASSERT_EQ(t.post(list.path, list.longer).status, 200) << name << " " << n;
    }
    EXPECT_EQ(t.post(list.path, list.longer).status, 409) << name;
  }
}

}  // namespace bounds_test
}  // namespace lk::emulator
