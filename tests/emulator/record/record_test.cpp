// A recording replays identically; a modification is reported at its location.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <span>
#include <sstream>

#include "emulator/config/candump_log.hpp"
#include "emulator/config/events/config_directives.hpp"
#include "emulator/config/profile.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/files/json_table.hpp"
#include "emulator/files/output_file.hpp"
#include "emulator/io/live/line.hpp"
#include "emulator/monitor/record/recorder.hpp"
#include "emulator/monitor/record/replay.hpp"
#include "tests/support/frames.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::emulator {
namespace record_test {

namespace fs = std::filesystem;
using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr const char* kRobot = R"(
seed = 7
[[bus]]
interface = "vcan0"
[[bus.drive]]
ids = "1-3"
motor = "mf7015"
quirks.current_loop = "fast"  # moves within the few ms of a run
[[bus.event]]
at_s = 0.05
id = 2
power = "cycle"
off_s = 0.02
[[bus.event]]
at_s = 0.1
id = 3
fault = { kind = "drop", probability = 0.3, for_s = 0.2 }
[[bus]]
interface = "vcan1"
bitrate = 300_000
[[bus.drive]]
id = 1
motor = "mg4005"
generation = "v235"
)";

std::string text_of(const fs::path& file) { return read_regular_file(file, kLongestLog); }

ConfigTexts texts() {
  ConfigTexts all{kRobot, "robot.toml", {}};
  for (const char* motor : {"mf7015", "mg4005"}) {
    const std::string file = std::string(LKEMU_SOURCE_DIR) + "/configs/motors/" + motor + ".toml";
    all.motors[motor] = {motor, file, text_of(file)};
  }
  return all;
}

std::vector<BusConfig> robot() {
  const ConfigTexts all = texts();
  return parse_config(kRobot, "robot.toml", {}, [&](const std::string& name) {
    return parse_profile(all.motors.at(name), {});
  });
}

RecordingInfo info() {
  RecordingInfo info;
  info.version = LKEMU_VERSION;
  info.clock = "realtime";
  info.started_utc = "2026-01-01T00:00:00Z";
  return info;
}

/// Recorded buses, with the actions of the program around them.
class Live {
 public:
  Live(const fs::path& directory, const std::vector<BusConfig>& buses)
      : configs_(buses), recorder_(directory, info(), texts(), buses) {
    for (const BusConfig& bus : buses) buses_.emplace_back(bus);
  }

  void host(std::size_t n, SimTime at, const protocol::Frame& frame) {
    at = frame_instant(at, buses_[n].time());
    advance(n, at);
    recorder_.host_frame(n, at, frame);
    buses_[n].receive({at, frame});
  }
  void directive(std::size_t n, const std::string& json) {
    const toml::table table = parse_json_table(json);
    TableReader reader(table, "request", "");
    for (const auto& one : read_directives(reader, configs_[n], Timing::kOptional, &buses_[n])) {
      one.when || one.at > buses_[n].time() ? buses_[n].plan(one) : buses_[n].apply(one.directive);
    }
    recorder_.directive(n, buses_[n].time(), json);
  }
  /// The disk refuses the last write.
  void refuse_rom(std::size_t n, int id) {
    std::vector<RomWrite> writes;
    buses_[n].take_rom_writes(writes);
    const auto servo = std::ranges::find(configs_[n].servos, id, &ServoConfig::id);
    buses_[n].restore_rom(id, servo->rom, servo->wear);
    recorder_.restored_rom(n, buses_[n].time(), id, servo->rom, servo->wear);
  }
  void advance(std::size_t n, SimTime until) {
    buses_[n].advance_to(until);
    std::vector<TimedFrame> replies;
    buses_[n].take_replies(replies);
    for (const TimedFrame& reply : replies) recorder_.reply(n, reply);
    replies_ += replies.size();
  }
  void end() {
    std::vector<SimTime> times;
    for (const Bus& bus : buses_) times.push_back(bus.time());
    recorder_.end(times);
  }
  SimTime time(std::size_t n) const { return buses_[n].time(); }
  std::uint64_t replies() const { return replies_; }

 private:
  std::vector<BusConfig> configs_;
  std::vector<Bus> buses_;
  Recorder recorder_;
  std::uint64_t replies_ = 0;
};

/// The replay of a recording in `directory`.
struct Again {
  explicit Again(const fs::path& directory)
      : recording(read_recording(directory)), replay(recording.buses) {
    end = replay_recording(directory, recording, replay);
  }
  Recording recording;
  Replay replay;
  ReplayEnd end;
};

class Record : public ::testing::Test {
 protected:
  /// Makes a random run on both buses; returns the number of replies.
  std::uint64_t make(bool ended = true, const std::vector<BusConfig>& buses = robot()) {
    std::mt19937 dice(3);
    Live live(directory(), buses);
    constexpr std::uint8_t kCommands[] = {0x9A, 0x9C, 0x9D, 0x90, 0x92, 0xA1, 0xA2, 0xA4,
                                          0x32, 0x30, 0x81, 0x88, 0x80, 0x19, 0xEE};
    for (int n = 0; n < 1500; ++n) {
      const std::size_t bus = dice() % 3 == 0 ? 1 : 0;
      protocol::Frame frame;
      frame.id = 0x141 + static_cast<std::uint32_t>(dice() % (bus == 0 ? 4 : 1));
      for (auto& byte : std::span(frame.data).first(protocol::kCanBytes))
        byte = static_cast<std::uint8_t>(dice());
      frame.data[0] = kCommands[dice() % std::size(kCommands)];
      const SimTime at = live.time(bus) + SimTime(dice() % 600'000) - microseconds(100);
      live.host(bus, at, frame);
      if (n % 7 == 0) live.advance(bus, live.time(bus) + microseconds(dice() % 2000));
      if (n == 300) live.directive(0, R"({"id": 1, "settings": {"max_speed_dps": 100.5}})");
      if (n == 400) live.directive(0, R"({"ids": "1-2", "fault": "slow_replies"})");
      if (n == 500) live.directive(1, R"({"id": 1, "load": {"tau_Nm": 0.3}})");
      if (n == 600) {
        live.directive(0, R"({"when": {"id": 1, "command": "0x9C", "count": 1},)"
                          R"( "id": 1, "fault": {"kind": "hang", "for_s": 0.05}})");
      }
      if (n == 700) live.directive(0, R"({"mark": "half way"})");
      if (n == 800) live.directive(0, R"({"at_s": 0.3, "id": 2, "supply_V": 11.7, "ramp_s": 0.1})");
      if (n == 900) live.directive(0, R"({"clear": "all"})");
      if (n == 1000) live.host(0, live.time(0), test::frame("141#9100000000002000"));
      if (n == 1001) live.advance(0, live.time(0) + milliseconds(20));  // the flash has written it
      if (n == 1002) live.refuse_rom(0, 1);
      if (n == 1003) live.directive(0, R"({"id": 1, "fault": "reset"})");
      if (n == 1004) live.advance(0, live.time(0) + milliseconds(100));
      if (n == 1005) live.host(0, live.time(0), test::frame("141#9000000000000000"));
    }
    for (std::size_t bus = 0; bus < 2; ++bus) live.advance(bus, live.time(bus) + milliseconds(20));
    if (ended) live.end();
    return live.replies();
  }

  fs::path directory() const { return scratch_ / "recording"; }
  std::vector<std::string> frames() const {
    std::ifstream file(directory() / kFramesFile);
    std::vector<std::string> lines;
    for (std::string line; std::getline(file, line);) lines.push_back(line);
    return lines;
  }
  void write_frames(const std::vector<std::string>& lines) const {
    std::ofstream file(directory() / kFramesFile);
    for (const std::string& line : lines) file << line << '\n';
  }
  /// Replays the recording with other frames.
  Again replay(const std::vector<std::string>& lines) const {
    write_frames(lines);
    return Again(directory());
  }
  std::string problem() const {
    try {
      const Again again(directory());
    } catch (const StartError& error) {
      return error.what();
    }
    return "none";
  }

  const test::TempDirectory own_;
  const fs::path& scratch_ = own_.path();
};

std::string text(const Again& again) {
  const auto& difference = again.replay.difference();
  if (!difference) return "identical";
  const auto bus = std::ranges::find(again.recording.buses, difference->bus, &BusConfig::interface);
  return difference_text(*difference, *bus, again.recording.info);
}

TEST_F(Record, ReplaysIdentically) {
  const std::uint64_t replies = make();
  ASSERT_GT(replies, 700U);
  const Again again(directory());
  EXPECT_EQ(text(again), "identical");
  EXPECT_EQ(again.replay.host_frames(), 1502U);
  EXPECT_EQ(again.replay.equal_replies(), replies);
  EXPECT_TRUE(again.end.complete);
}

// The recording contains the initial ROM of the drives.
TEST_F(Record, ContainsTheInitialRom) {
  std::vector<BusConfig> buses = robot();
  ServoConfig& servo = buses[0].servos[0];
  servo.rom.gains = {1, 2, 3, 4, 5, 6};
  servo.wear[static_cast<std::size_t>(RomParameter::kGains)] = 9;
  make(true, buses);
  const Again again(directory());
  EXPECT_EQ(again.recording.buses[0].servos[0].rom, servo.rom);
  EXPECT_EQ(again.recording.buses[0].servos[0].wear, servo.wear);
  EXPECT_EQ(text(again), "identical");
  fs::remove(directory() / "rom" / "vcan0-1.toml");
  EXPECT_NE(text(Again(directory())), "identical");
}

TEST_F(Record, NeedsEveryDirective) {
  make();
  const std::string all = text_of(directory() / kInputsFile);
  std::istringstream lines(all);
  int left_out = 0;
  for (std::string line; std::getline(lines, line);) {
    const bool matters = line.find("supply_V") != std::string::npos ||
                         line.find("slow_replies") != std::string::npos ||
                         line.find("hang") != std::string::npos;
    if (!matters) continue;
    ++left_out;
    std::string without = all;
    without.erase(without.find(line), line.size() + 1);
    std::ofstream(directory() / kInputsFile) << without;
    EXPECT_NE(text(Again(directory())), "identical") << line;
  }
  EXPECT_EQ(left_out, 3);
}

// --- modified recordings

/// Returns the index of the reply nearest to the middle of the log.
std::size_t middle_reply(const std::vector<std::string>& lines) {
  std::size_t place = lines.size() / 2;
  while (!lines[place].ends_with('R')) ++place;
  return place;
}

CandumpLine parsed(const std::string& line) {
  return std::get<CandumpLine>(parse_candump_line(line));
}

TEST_F(Record, DetectsAChangedReply) {
  make();
  auto lines = frames();
  std::string& line = lines[middle_reply(lines)];
  const CandumpLine is = parsed(line);
  char& digit = line[line.size() - 3];  // of the last byte
  digit = digit == '0' ? '1' : '0';
  const CandumpLine should = parsed(line);
  const Again again = replay(lines);
  const auto& difference = again.replay.difference();
  ASSERT_TRUE(difference);
  EXPECT_EQ(difference->bus, is.interface);
  ASSERT_TRUE(difference->recorded && difference->replayed);
  EXPECT_EQ(difference->recorded->frame, should.frame);
  EXPECT_EQ(difference->replayed->frame, is.frame);
  EXPECT_EQ(std::chrono::floor<microseconds>(difference->replayed->at), is.at);
  EXPECT_EQ(difference->before.size(), Replay::kContext);
  EXPECT_NE(text(again).find("first difference on " + is.interface), std::string::npos);
}

TEST_F(Record, DetectsLateMissingAndExtraReplies) {
  make();
  const auto lines = frames();
  const std::size_t place = middle_reply(lines);
  const auto at_place = static_cast<std::ptrdiff_t>(place);
  const CandumpLine is = parsed(lines[place]);
  auto late = lines;
  late[place] = candump_line(is.at + microseconds(1), is.interface, is.frame, is.direction);
  const Again delayed = replay(late);
  ASSERT_TRUE(delayed.replay.difference());
  EXPECT_EQ(delayed.replay.difference()->recorded->at, is.at + microseconds(1));
  auto fewer = lines;
  fewer.erase(fewer.begin() + at_place);
  const Again missing = replay(fewer);
  ASSERT_TRUE(missing.replay.difference() && missing.replay.difference()->replayed);
  EXPECT_EQ(missing.replay.difference()->replayed->frame, is.frame);
  auto more = lines;
  more.insert(more.begin() + at_place, lines[place]);
  const Again twice = replay(more);
  ASSERT_TRUE(twice.replay.difference() && twice.replay.difference()->recorded);
  EXPECT_EQ(twice.replay.difference()->recorded->frame, is.frame);
}

TEST_F(Record, DetectsSwappedReplies) {
  make();
  auto lines = frames();
  // Two adjacent replies of one bus with different data.
  const auto two = std::ranges::adjacent_find(lines, [](const auto& a, const auto& b) {
    return a.ends_with('R') && b.ends_with('R') && a.substr(20) != b.substr(20) &&
           a.substr(20, 5) == b.substr(20, 5);
  });
  ASSERT_NE(two, lines.end());
  const CandumpLine first = parsed(*two);
  std::swap(*two, *(two + 1));
  const Again again = replay(lines);
  ASSERT_TRUE(again.replay.difference());
  EXPECT_EQ(again.replay.difference()->replayed->frame, first.frame);
}

TEST_F(Record, DetectsAChangedQueryByItsReply) {
  make();
  auto lines = frames();
  auto line = std::ranges::find_if(lines, [](const std::string& one) {
    return one.find("vcan1 141#9C") != std::string::npos && one.ends_with('T');
  });
  ASSERT_NE(line, lines.end());
  line->replace(line->find("#9C"), 3, "#90");
  EXPECT_TRUE(replay(lines).replay.difference());
}

// --- truncated recordings

TEST_F(Record, TruncatedIsValidUpToItsLastLine) {
  make(false);
  const std::string all = text_of(directory() / kFramesFile);
  for (std::size_t part = 1; part < 40; ++part) {
    const std::size_t size = all.size() * part / 40 + part;
    std::ofstream(directory() / kFramesFile) << all.substr(0, size);
    const Again again(directory());
    EXPECT_EQ(text(again), "identical") << size;
    EXPECT_FALSE(again.end.complete);
    EXPECT_EQ(again.end.cut_line, all[size - 1] != '\n') << size;
    EXPECT_GT(again.replay.equal_replies(), 0U);
  }
}

TEST_F(Record, RejectsUnreadableRecordings) {
  EXPECT_NE(problem().find("is not a recording"), std::string::npos) << problem();
  make();
  const fs::path about = directory() / kRecordingFile;
  const std::string good = text_of(about);
  std::ofstream(about) << "{";
  EXPECT_NE(problem().find("recording.json: not as lk-emu writes it"), std::string::npos);
  std::string other = good;
  other.replace(other.find("\"format\": 1"), 11, "\"format\": 2");
  std::ofstream(about) << other;
  EXPECT_NE(problem().find("format 2 is not known"), std::string::npos) << problem();
  std::ofstream(about) << good;
  auto lines = frames();
  lines[4] = "(0000000000.000100) vcan0 141#9C";
  write_frames(lines);
  EXPECT_NE(problem().find("frames.log:5: "), std::string::npos) << problem();
  lines[4] = "(0000000000.000100) vcan7 141#9C00000000000000 T";
  write_frames(lines);
  EXPECT_NE(problem().find("frames.log:5: no bus vcan7"), std::string::npos) << problem();
  fs::remove(directory() / kInputsFile);
  EXPECT_NE(problem().find(kInputsFile), std::string::npos) << problem();
}

TEST_F(Record, SuggestsHowToMakeAnMcapFile) {
  const fs::path file = directory().parent_path() / "run.mcap";
  try {
    const Live live(file, robot());
    FAIL() << "no complaint";
  } catch (const StartError& problem) {
    EXPECT_EQ(problem.what(), "cannot record in " + file.string() +
                                  ": record into a directory, then run python3 -m lkemu.mcap "
                                  "DIRECTORY");
  }
  EXPECT_FALSE(fs::exists(file));
}

}  // namespace record_test
}  // namespace lk::emulator
