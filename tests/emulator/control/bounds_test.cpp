// Every list that a client can extend is bounded. The table in docs/internals/testing.md and the
// constants of the source agree with the table here.

#include <gtest/gtest.h>

#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/emulator/control/control_support.hpp"

namespace lk::emulator {
namespace bounds_test {

const std::string kSource = LKEMU_SOURCE_DIR "/";

std::string text_of(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Returns the value of a constant in a file of emulator/: a number, or two with * or << between.
std::uint64_t value_of(const std::string& file, const std::string& constant) {
  std::smatch found;
  const std::string text = text_of(kSource + "emulator/" + file);
  const std::regex pattern("\\b" + constant + R"( =\s*([^;]+);)");
  if (!std::regex_search(text, found, pattern)) return 0;
  std::string words = found[1];
  words = std::regex_replace(words, std::regex(R"(std::size_t\{(\d+)\})"), "$1");
  std::erase(words, '\'');
  std::smatch parts;
  if (!std::regex_match(words, parts, std::regex(R"((\d+)U?(?: (\*|<<) (\d+)U?)?)"))) return 0;
  const std::uint64_t first = std::stoull(parts[1]);
  if (!parts[2].matched) return first;
  const std::uint64_t second = std::stoull(parts[3]);
  return parts[2] == "*" ? first * second : first << second;
}

struct List {
  const char* name;
  const char* of_each;
  const char* file;
  const char* constant;
  const char* beyond;
  const char* longer = nullptr;  // the request that adds one entry; null: tested elsewhere
  const char* path = "/directives";
};

constexpr const char* kRefused = "409";
constexpr const char* kMissed = "missed, and counted";
constexpr const char* kLost = "lost, and counted";

// clang-format off
const std::vector<List> kLists = {
    {"faults", "bus", "core/faults/fault_board.hpp", "kMax", "the oldest that is over makes room; 409 where none is",
     R"({"id": 1, "fault": "hang"})"},
    {"conditions", "bus", "core/bus/conditions.hpp", "kMax", kRefused,
     R"({"id": 1, "turn_deg": 1, "when": {"signal": "speed_dps", "above": 1e9}})"},
    {"planned directives", "bus", "io/control/control_api.hpp", "kMaxPlanned", kRefused,
     R"({"id": 1, "turn_deg": 1, "at_s": 3600})"},
    {"settings for the flash", "drive", "core/bus/can_wire.hpp", "kDriveQueue", kRefused,
     R"({"id": 1, "settings": {"max_speed_dps": 100}})"},
    {"frames for the wire", "bus", "core/host_queue.hpp", "kDefaultFrames", kRefused,
     R"({"command": "state_2", "id": 1})", "/frames"},
    {"frames in an adapter without a depth", "bus", "core/wire_timing.hpp", "kMaxInAdapter", kLost},
    {"frames while time stands still", "bus", "io/live/line.hpp", "kMaxBacklog", kLost},
    {"packets that waited while time slipped", "bus", "io/live/line.hpp", "kMaxSpaced", "as they come; lost, and counted, if the wire has no room either"},
    {"replies that wait for the disk", "drive", "files/rom_store.hpp", "kMaxHeld", kLost},
    {"advice", "bus", "monitor/advice/advice.hpp", "kMax", "counted"},
    {"causes of one kind of advice", "drive", "monitor/advice/advice.hpp", "kMaxCauses", "counted"},
    {"replies for an interface", "bus", "io/transports/socketcan.cpp", "kMaxPending", kLost},
    {"clients of slcan and socketcand", "port", "io/transports/port.cpp", "kMaxClients", "refused, and counted"},
    {"bytes that a client has not read", "client", "io/transports/client_set.hpp", "kMaxUnsent", "frames are lost, and counted"},
    {"bytes of answers behind these", "client", "io/transports/client_set.hpp", "kMaxAnswers", "answers are lost, and counted"},
    {"jobs of socketcand", "client", "io/transports/socketcand.hpp", "kMaxJobs", "an error"},
    {"bytes of a line of slcan", "client", "io/transports/slcan.hpp", "kLongestLine", "an error"},
    {"bytes of a message of socketcand", "client", "io/transports/socketcand.hpp", "kLongestMessage", "an error"},
    {"bytes of a datagram", "datagram", "io/transports/multicast_port.hpp", "kLongestCanMsgpack", "dropped, and counted"},
    {"connections", "entrance", "io/control/http_session.hpp", "kMaxConnections", "the idlest is closed, or the newcomer when none is idle"},
    {"WebSockets", "entrance", "io/control/http_session.hpp", "kMaxStreams", "429"},
    {"streams of frames", "program", "io/control/streams.hpp", "kMaxFrameStreams", "429"},
    {"streams of a body", "program", "io/control/streams.hpp", "kMaxBodyStreams", "429"},
    {"frames for a reader", "stream", "io/control/streams.hpp", "kMaxGathered", kMissed},
    {"bytes of samples for a reader", "stream", "io/control/streams.hpp", "kMaxQueued", kMissed},
    {"samples of a message", "stream", "core/telemetry.hpp", "kMaxSamplesPerMessage", "400"},
    {"values of telemetry a second", "program", "io/control/streams.hpp", "kMaxTelemetryOfAll", "429"},
    {"bytes of a header", "request", "io/control/http_session.hpp", "kLongestHeader", "431"},
    {"bytes of a body", "request", "io/control/http_session.hpp", "kLongestBody", "413"},
    {"levels of JSON", "request", "files/json_table.hpp", "kDeepestJson", "400"},
    {"keys of a JSON object", "request", "files/json_table.cpp", "kMaxJsonKeys", "400"},
    {"bytes of a message", "WebSocket", "io/control/http_session.hpp", "kLongestMessage", "closed"},
    {"bytes of a scenario", "scenario, and again its logs", "io/program/scenario_activity.hpp", "kLongestFile", "400"},
    {"bytes for the disk", "recording", "monitor/record/recorder.hpp", "kMaxWaiting", "it ends"},
};

/// Constants that do not bound a list of clients.
const std::set<std::string> kOthers = {
    // other constants of lists in the table
    "core/bus/bus.hpp:kMaxFaults", "core/bus/bus.hpp:kMaxWaiting",
    "core/bus/serial_wire.hpp:kDriveQueue", "core/bus/serial_wire.hpp:kHostQueue",
    "core/bus/wire.hpp:kDriveQueue",
    "core/host_queue.hpp:kMaxFrames",
    // limits on work at once, not on memory
    "files/output_file.cpp:kMaxLinks",
    "core/faults/fault_board.hpp:kMaxSamples", "io/control/http_session.cpp:kMaxLingerReads",
    "io/live/line.cpp:kMaxLeaving", "io/live/world.cpp:kMaxRounds", "io/transports/client_set.cpp:kMaxEvents",
    "io/transports/multicast_port.cpp:kMaxDatagrams", "io/transports/port.hpp:kMaxBatches",
    "io/transports/client_set.cpp:kMaxAtOnce",
    // lengths of text by a person or by the program itself
    "io/control/control_server.cpp:kLongestToken", "io/control/http_session.cpp:kLongestBuffer",
    "monitor/record/replay.cpp:kLongestLine", "io/shafts/shaft_body.cpp:kLongestReason",
    "io/transports/port.cpp:kMaxPlaceLength", "io/transports/netlink.cpp:kLongestAnswer",
    "io/transports/slcan.cpp:kLongestAck",
    "io/transports/socket_listener.cpp:kLongestPath", "io/transports/socketcand.cpp:kMaxWords",
    // parameters of a fault, a counter of a controller
    "core/fault.hpp:kMaxFaultParams", "core/bus/can_errors.cpp:kMaxReceiveErrors",
    // a width of a field on the wire
    "core/servo/shaft_angles.cpp:kMaxWireBits",
};
// clang-format on

TEST(Bounds, MatchTheDocument) {
  const std::string page = text_of(kSource + "docs/internals/testing.md");
  const std::size_t begin = page.find("| what a client can lengthen |");
  const std::string table = page.substr(begin, page.find("\n\n", begin) - begin);
  for (const List& list : kLists) {
    const std::string row = "\n| " + std::string(list.name) + " | " + list.of_each + " | " +
                            std::to_string(value_of(list.file, list.constant)) + " | " +
                            list.beyond + " | `";
    EXPECT_NE(table.find(row), std::string::npos) << row;
  }
  const auto rows = static_cast<std::size_t>(std::ranges::count(table, '\n'));
  EXPECT_EQ(rows, 1 + kLists.size()) << "and no others";
}

/// A new constant with such a name must be added to one of the two tables.
TEST(Bounds, CoverAllConstantsOfTheSource) {
  std::set<std::string> known = kOthers;
  for (const List& list : kLists) known.insert(std::string(list.file) + ":" + list.constant);
  const std::regex constant(
      R"(constexpr (?:std::size_t|int|std::uint64_t) (k(?:Max|Most|Deepest|Longest|HostQueue|DriveQueue)\w*) =)");
  std::set<std::string> found;
  for (const char* room : {"core", "files", "io", "monitor/advice", "monitor/record"}) {
    const std::string root = kSource + "emulator/";
    for (const auto& file : std::filesystem::recursive_directory_iterator(root + room)) {
      const std::string path = file.path().string();
      if (!path.ends_with(".hpp") && !path.ends_with(".cpp")) continue;
      const std::string text = text_of(path);
      for (std::sregex_iterator at(text.begin(), text.end(), constant), end; at != end; ++at) {
        found.insert(path.substr(root.size()) + ":" + (*at)[1].str());
      }
    }
  }
  for (const std::string& one : found) EXPECT_TRUE(known.contains(one)) << one;
  for (const std::string& one : kOthers) EXPECT_TRUE(found.contains(one)) << one << " is gone";
}

TEST(Bounds, LimitEachListOfABus) {
  for (const List& list : kLists) {
    if (list.longer == nullptr) continue;
    TestWorld t;
    const std::uint64_t bound = value_of(list.file, list.constant);
    ASSERT_GT(bound, 0U) << list.name;
    for (std::uint64_t n = 0; n < bound; ++n) {
      ASSERT_EQ(t.post(list.path, list.longer).status, 200) << list.name << " " << n;
    }
    EXPECT_EQ(t.post(list.path, list.longer).status, 409) << list.name;
  }
}

}  // namespace bounds_test
}  // namespace lk::emulator
