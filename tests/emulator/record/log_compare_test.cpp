// A log without directions: the pairing finds queries and replies, and the comparison checks each
// quantity against the emulator's replies to the same queries.

#include "emulator/monitor/record/log_compare.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <sstream>

#include "emulator/config/candump_log.hpp"
#include "emulator/files/output_file.hpp"
#include "emulator/files/profile_files.hpp"
#include "tests/support/serial_bus.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace log_compare_test {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using test::frame;

/// Returns a log; a line has a time in us, a frame, and perhaps T (from a host) or R.
std::vector<LoggedFrame> log_of(const std::vector<const char*>& lines) {
  std::vector<LoggedFrame> log;
  for (const char* const line : lines) {
    std::istringstream words(line);
    int at_us = 0;
    std::string text;
    std::string direction;
    words >> at_us >> text >> direction;
    log.push_back({{microseconds(at_us), frame(text)}, std::nullopt});
    if (!direction.empty()) log.back().from_host = direction == "T";
  }
  return log;
}

/// 31 replies written by hand (tests/golden), each after its query. Four queries have no reply: to
/// an absent drive, an unknown command, too short, for several drives.
constexpr std::size_t kGoldenReplies = 31;
std::vector<LoggedFrame> golden(bool with_directions) {
  const std::string file = std::string(LKEMU_SOURCE_DIR) + "/tests/golden/resting_drive.log";
  std::vector<LoggedFrame> frames;
  for (const CandumpLine& line : parse_candump_log(read_regular_file(file, kLongestLog), file)) {
    frames.push_back({{line.at, line.frame}, std::nullopt});
    const bool sent = line.direction == CandumpLine::Direction::kSent;
    if (with_directions) frames.back().from_host = sent;
  }
  return frames;
}

const ComparedValue* find(const LogComparison& comparison, int command, std::string_view name) {
  const auto found = std::ranges::find_if(comparison.values, [&](const ComparedValue& value) {
    return value.command == command && value.name == name;
  });
  return found != comparison.values.end() ? &*found : nullptr;
}

const ComparedCommand* find(const LogComparison& comparison, int command) {
  const auto found = std::ranges::find(comparison.commands, static_cast<std::uint8_t>(command),
                                       &ComparedCommand::command);
  return found != comparison.commands.end() ? &*found : nullptr;
}

// --- pairing

TEST(LogPairing, InfersDirections) {
  const auto bus = test::bus_config({1});
  const PairedLog told = pair_log(golden(true), bus);
  const PairedLog found = pair_log(golden(false), bus);
  EXPECT_EQ(told.sent.size(), kGoldenReplies + 3);
  EXPECT_EQ(told.unknown_drive_frames, 1U);
  EXPECT_EQ(told.ambiguous, 0U);
  EXPECT_EQ(found.sent, told.sent);
  ASSERT_EQ(found.exchanges.size(), kGoldenReplies);
  for (std::size_t n = 0; n < kGoldenReplies; ++n) {
    ASSERT_TRUE(found.exchanges[n].reply && told.exchanges[n].reply) << n;
    EXPECT_EQ(found.exchanges[n].reply, told.exchanges[n].reply) << n;
  }
  // An echo equals its query, so the host could have sent both.
  const auto log = golden(true);
  std::uint64_t equal = 0;
  for (std::size_t n = 0; n + 1 < log.size(); n += 2) {
    if (log[n].timed.frame == log[n + 1].timed.frame) ++equal;
  }
  EXPECT_EQ(found.ambiguous, equal);
  EXPECT_GT(equal, 0U);
}

TEST(LogPairing, FindsTheReplyOfEachQuery) {
  const struct {
    const char* about;
    std::vector<const char*> log;
    std::vector<int> replies;             // of each exchange: place in the log; -1: none
    std::array<std::uint64_t, 4> counts;  // sent, ambiguous, orphans, of unknown drives
    bool broadcast = false;               // drives 1 and 3 answer only multi-drive queries
  } cases[] = {
      {"a lost reply does not shift others; the first reply fits two queries",
       {"0 141#9C00000000000000", "10000 141#9C00000000000000", "11000 141#9C19000000000008",
        "20000 141#9C00000000000000", "21000 141#9C19000000000008"},
       {-1, 2, 4},
       {3, 1, 0, 0}},
      {"a batch with directions keeps its order",
       {"0 141#A100000064000000 T", "1 141#8100000000000000 T", "2 141#A100000065000000 T",
        "3 141#8100000000000000 T", "4 141#A119000000000008 R", "5 141#8100000000000000 R",
        "6 141#A11A000000000008 R", "7 141#8100000000000000 R"},
       {4, 5, 6, 7},
       {4, 0, 0, 0}},
      {"a batch is answered in order",
       {"0 141#A100000064000000", "1 141#A100000065000000", "2 141#A119000000000008",
        "3 141#A11A000000000008"},
       {2, 3},
       {2, 1, 0, 0}},
      {"identifiers of their own mark replies",
       {"0 141#8100000000000000", "1 241#8100000000000000", "2 141#8100000000000000",
        "3 141#8100000000000000", "4 241#8100000000000000", "5 241#8100000000000000"},
       {1, 4, 5},
       {3, 0, 0, 0}},
      {"a log begins with a reply",
       {"0 141#9C19000000000008", "1000 141#9C00000000000000", "2000 141#9C19000000000008"},
       {2},
       {1, 1, 1, 0}},
      {"drives in broadcast mode answer a multi-drive query",
       {"0 280#6400640064006400", "300 141#A119000000000008", "600 143#A119000000000008"},
       {1, 2},
       {1, 0, 0, 0},
       true},
      {"unknown drives are left out; a third party's frame takes time on the wire",
       {"0 145#9C00000000000000", "1000 145#9C19000000000008", "2000 7FF#00"},
       {},
       {1, 0, 0, 2}},
  };
  for (const auto& one : cases) {
    SCOPED_TRACE(one.about);
    auto bus = test::bus_config({1, 2, 3});
    for (const std::size_t n : {0U, 2U}) bus.servos[n].rom.broadcast_mode = one.broadcast;
    const auto log = log_of(one.log);
    const PairedLog paired = pair_log(log, bus);
    EXPECT_EQ(one.counts,
              (std::array<std::uint64_t, 4>{paired.sent.size(), paired.ambiguous, paired.orphans,
                                            paired.unknown_drive_frames}));
    ASSERT_EQ(paired.exchanges.size(), one.replies.size());
    for (std::size_t n = 0; n < one.replies.size(); ++n) {
      const int place = one.replies[n];
      const auto reply =
          place < 0 ? std::nullopt : std::optional(log[static_cast<std::size_t>(place)].timed);
      EXPECT_EQ(paired.exchanges[n].reply, reply) << n;
    }
  }
}

/// Fifty queries at 50 Hz, the eleventh without a reply, and replies after 300 us.
std::vector<LoggedFrame> fifty(const char* reply, bool has_directions) {
  std::vector<LoggedFrame> log;
  const auto add = [&](SimTime at, const char* text, bool from_host) {
    log.push_back({{at, frame(text)}, has_directions ? std::optional(from_host) : std::nullopt});
  };
  for (int n = 0; n < 50; ++n) {
    add(n * milliseconds(20), "141#9C00000000000000", true);
    if (n != 10) add(n * milliseconds(20) + microseconds(300), reply, false);
  }
  return log;
}

TEST(LogPairing, LostReplyDoesNotShiftOthersWithDirections) {
  const auto bus = test::bus_config({1});
  for (const char* reply : {"141#9C19000000000008", "241#9C19000000000008"}) {
    const PairedLog paired = pair_log(fifty(reply, true), bus);
    EXPECT_EQ(paired.ambiguous, 0U);
    EXPECT_EQ(paired.orphans, 0U);
    ASSERT_EQ(paired.exchanges.size(), 50U);
    for (std::size_t n = 0; n < 50; ++n) {
      const auto& answer = paired.exchanges[n].reply;
      ASSERT_EQ(answer.has_value(), n != 10) << reply << ' ' << n;
      if (!answer) continue;
      EXPECT_EQ(answer->at - paired.sent[n].at, microseconds(300)) << reply << ' ' << n;
    }
  }
}

/// With the reply identifiers of the newest manual, with and without directions in the log.
TEST(LogPairing, PairsRepliesWithOwnIdentifiers) {
  auto bus = test::bus_config({1});
  bus.servos[0].quirks.dialect.reply_id_base = 0x180;
  for (const bool has_directions : {true, false}) {
    const LogComparison comparison =
        compare_log(fifty("181#9C19000000000008", has_directions), bus);
    const ComparedCommand* state = find(comparison, 0x9C);
    ASSERT_NE(state, nullptr);
    EXPECT_EQ(state->queries, 50U);
    EXPECT_EQ(state->in_log, 49U);
    EXPECT_EQ(state->emulated, 50U);
    EXPECT_EQ(state->extra, 1U);
    EXPECT_EQ(state->missing + comparison.orphans, 0U);
  }
}

// --- comparison

TEST(LogComparison, EmulatorMatchesTheGoldenLog) {
  auto bus = test::bus_config({1});
  bus.servos[0].quirks.off_needs_run = true;  // as the drive of the log
  const auto comparison = compare_log(golden(false), bus);
  EXPECT_EQ(comparison.commands.size(), 26U);  // the commands of the legacy manual
  std::uint64_t replies = 0;
  for (const ComparedCommand& command : comparison.commands) {
    EXPECT_EQ(command.in_log, command.queries) << int{command.command};
    EXPECT_EQ(command.emulated, command.queries) << int{command.command};
    EXPECT_EQ(command.missing + command.extra + command.undecodable, 0U);
    EXPECT_EQ(command.latency_in_log.most, SimTime{0});
    replies += command.in_log;
  }
  EXPECT_EQ(replies, kGoldenReplies);
  for (const ComparedValue& value : comparison.values) {
    EXPECT_EQ(value.equal, value.count) << int{value.command} << ' ' << value.name;
    EXPECT_EQ(value.most, 0);
  }
}

/// Returns a log of a bus with this configuration.
std::vector<LoggedFrame> emulated_log(const BusConfig& config, const char* query) {
  Bus bus(config);
  bus.advance_to(kBeforeLog);
  std::vector<LoggedFrame> log;
  for (int n = 0; n < 50; ++n) {
    const TimedFrame sent{bus.time(), frame(query)};
    log.push_back({sent, std::nullopt});
    bus.receive(sent);
    bus.advance_to(bus.time() + milliseconds(2));
    std::vector<TimedFrame> replies;
    bus.take_replies(replies);
    for (const TimedFrame& reply : replies) log.push_back({reply, std::nullopt});
  }
  return log;
}

TEST(LogComparison, EmulatedLogIsEqualInTime) {
  const auto bus = test::bus_config({1}, 1'000'000);
  const auto comparison = compare_log(emulated_log(bus, "141#A200000010270000"), bus);
  const auto* command = find(comparison, 0xA2);
  ASSERT_NE(command, nullptr);
  EXPECT_EQ(command->in_log, 50U);
  EXPECT_EQ(command->latency_in_log.median, command->latency_emulated.median);
  EXPECT_EQ(command->latency_in_log.most, command->latency_emulated.most);
  EXPECT_GT(command->latency_in_log.median, microseconds(300));  // two frames and a reply time
  for (const ComparedValue& value : comparison.values) EXPECT_EQ(value.equal, 50U) << value.name;
}

TEST(LogComparison, ShiftAppearsInOneQuantityOnly) {
  const auto bus = test::bus_config({1});
  auto log = emulated_log(bus, "141#9C00000000000000");
  std::size_t shifted = 0;
  for (LoggedFrame& one : log) {
    if (one.timed.frame.data[1] == 0) continue;
    one.timed.frame.data[1] = static_cast<std::uint8_t>(one.timed.frame.data[1] + 3);  // °C
    ++shifted;
  }
  ASSERT_EQ(shifted, 50U);
  const auto comparison = compare_log(log, bus);
  const auto* temperature = find(comparison, 0x9C, "temperature_C");
  ASSERT_NE(temperature, nullptr);
  EXPECT_EQ(temperature->equal, 0U);
  EXPECT_DOUBLE_EQ(temperature->mean(), 3);
  EXPECT_DOUBLE_EQ(temperature->most, 3);
  for (const char* other : {"iq_A", "speed_dps", "encoder_counts"}) {
    ASSERT_NE(find(comparison, 0x9C, other), nullptr) << other;
    EXPECT_EQ(find(comparison, 0x9C, other)->equal, 50U) << other;
  }
  EXPECT_NE(comparison_text(comparison).find("| 9C | temperature_C | 50 | 0 | 3 | 3 | drive 1 at"),
            std::string::npos)
      << comparison_text(comparison);
}

// The drive is at 2048 of 16384 counts; 16380 is 2052 counts back, not 14332 ahead.
TEST(LogComparison, HandlesEncoderWrap) {
  const auto bus = test::bus_config({1});
  const auto comparison =
      compare_log(log_of({"0 141#9C00000000000000", "1000 141#9C1900000000FC3F"}), bus);
  const auto* encoder = find(comparison, 0x9C, "encoder_counts");
  ASSERT_NE(encoder, nullptr);
  EXPECT_DOUBLE_EQ(encoder->most, 2052);
}

TEST(LogComparison, CountsRepliesMissingOnOneSide) {
  const auto bus = test::bus_config({1});
  const auto comparison = compare_log(
      log_of({"0 141#9A00000000000000", "1000 141#9C00000000000000", "2000 141#9C19000000000008"}),
      bus);
  ASSERT_NE(find(comparison, 0x9A), nullptr);
  EXPECT_EQ(find(comparison, 0x9A)->extra, 1U);
  EXPECT_EQ(find(comparison, 0x9A)->missing, 0U);
  EXPECT_EQ(find(comparison, 0x9C)->extra, 0U);
}

/// 0x42 of docs/reference/rs485.md differs from 0x42 on CAN.
TEST(LogComparison, NamesRs485Commands) {
  const auto bus = test::serial_bus({test::serial_drive(Generation::kV235)});
  const LoggedFrame query{
      {std::chrono::milliseconds(100), test::packet("3E 42 01 07 88 97 32 00 14 00 00 00 DD")},
      true};
  const LoggedFrame reply{{std::chrono::milliseconds(101), test::packet("3E 42 01 02 83 97 00 97")},
                          false};
  const std::string text = comparison_text(compare_log({query, reply}, bus));
  EXPECT_NE(text.find("| 42 write setting to RAM | 1 | 1 | 1 | 0 | 0 |"), std::string::npos)
      << text;
}

}  // namespace log_compare_test
}  // namespace lk::emulator
