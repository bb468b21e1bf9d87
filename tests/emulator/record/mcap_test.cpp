// A recording as MCAP has the contents of the directory that it would have been. Whether it is
// valid MCAP is checked by tests/support/mcap_reader.py (tests/vcan/mcap_host.py).

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <string_view>

#include "emulator/config/profile.hpp"
#include "emulator/files/json_table.hpp"
#include "emulator/ground/start_error.hpp"
#include "emulator/record/mcap_records.hpp"
#include "emulator/record/recorder.hpp"
#include "protocol/serial_framing.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::emulator {
namespace mcap_test {

namespace fs = std::filesystem;

constexpr const char* kRobot = R"(
[[bus]]
interface = "vcan0"
[[bus.drive]]
ids = "1-2"
motor = "mf7015"
[[bus]]
interface = "rs485:/tmp/arm"
[[bus.drive]]
id = 1
motor = "mf7015"
)";

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

ConfigTexts texts() {
  const std::string file = LKEMU_SOURCE_DIR "/configs/motors/mf7015.toml";
  return {kRobot, "robot.toml", {{"mf7015", {"mf7015", file, text_of(file)}}}};
}

std::vector<BusConfig> robot() {
  auto buses = parse_config(kRobot, "robot.toml", {}, [](const std::string& name) {
    return parse_profile(texts().motors.at(name), {});
  });
  buses[0].servos[1].wear[0] = 3;  // its ROM is attached
  return buses;
}

protocol::Frame frame(std::uint32_t id, protocol::FrameKind kind, std::uint8_t dlc) {
  protocol::Frame made;
  made.id = id;
  made.kind = kind;
  made.dlc = dlc;
  for (std::size_t n = 0; n < dlc; ++n) made.data[n] = static_cast<std::uint8_t>(0x9C + n);
  return made;
}

/// Whatever can be on a bus, and whatever else is recorded.
void record(const fs::path& place, bool ended) {
  using protocol::FrameKind;
  RecordingInfo info;
  info.version = LKEMU_VERSION;
  const auto buses = robot();
  Recorder recorder(place, info, texts(), buses);
  SimTime at{0};
  for (const FrameKind kind :
       {FrameKind::kData, FrameKind::kRemote, FrameKind::kError, FrameKind::kFd}) {
    for (const std::uint8_t dlc : {std::uint8_t{0}, std::uint8_t{3}, std::uint8_t{8}}) {
      auto one = frame(kind == FrameKind::kError ? 4 : 0x141, kind, dlc);
      if (kind == FrameKind::kRemote || kind == FrameKind::kFd) one.data = {};
      recorder.host_frame(0, at += std::chrono::microseconds(130), one);
    }
  }
  protocol::Frame extended = frame(0x12345678, FrameKind::kData, 8);
  extended.extended = true;
  recorder.host_frame(0, at += std::chrono::microseconds(130), extended);
  recorder.directive(0, at, R"({"id":1,"power":"off","mark":"关 \"x\""})");
  recorder.reply(0, {at += std::chrono::microseconds(130), frame(0x141, FrameKind::kData, 8)});
  const std::uint8_t noise[] = {0x00, 0xFF, 0x3E};
  recorder.host_frame(1, at, protocol::bytes_frame(noise));
  recorder.reply(1, {at, frame(0x141, FrameKind::kSerial, 8)});
  recorder.restored_rom(1, at, 1, buses[1].servos[0].rom, buses[1].servos[0].wear);
  if (ended) recorder.end({at, at});
}

/// By name, below `directory`.
std::map<std::string, std::string> files_of(const fs::path& directory) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(directory)) {
    if (!entry.is_regular_file()) continue;
    files[fs::relative(entry.path(), directory).string()] = text_of(entry.path());
  }
  return files;
}

/// Little-endian fields from the front of a record (https://mcap.dev/spec).
struct Fields {
  std::string_view rest;

  std::string_view take(std::size_t count) {
    const std::string_view taken = rest.substr(0, count);
    EXPECT_EQ(taken.size(), count);
    rest.remove_prefix(taken.size());
    return taken;
  }
  std::uint64_t number(std::size_t size) {
    std::uint64_t value = 0;
    const std::string_view bytes = take(size);
    for (std::size_t n = bytes.size(); n-- > 0;) {
      value = value << 8U | static_cast<std::uint8_t>(bytes[n]);
    }
    return value;
  }
  std::string_view text() { return take(number(4)); }
};

/// The files of a recording in the records of an MCAP file: attachments, and logs line by line.
class Contents {
 public:
  explicit Contents(std::string_view bytes) {
    files["frames.log"];
    files["directives.jsonl"];
    read_records({bytes.substr(mcap::kMagic.size())});
  }

  std::map<std::string, std::string> files;

 private:
  void read_records(Fields records) {
    while (!records.rest.empty()) {
      const auto op = static_cast<mcap::Op>(records.number(1));
      if (op == mcap::Op::kDataEnd) return;
      read({records.take(records.number(8))}, op);
    }
  }
  void read(Fields fields, mcap::Op op) {
    if (op == mcap::Op::kSchema) {
      const auto id = fields.number(2);
      schemas_[id] = fields.text();
    } else if (op == mcap::Op::kChannel) {
      const auto id = fields.number(2);
      channels_[id] = schemas_.at(fields.number(2));
    } else if (op == mcap::Op::kMessage) {
      const std::string& schema = channels_.at(fields.number(2));
      fields.take(4 + 8 + 8);  // sequence, times
      if (schema == "lk_emu.Directive") {
        files["directives.jsonl"] += std::string(fields.rest) + "\n";
      } else if (schema == "lk_emu.Frame") {
        files["frames.log"] += parse_json(fields.rest).at("line").get<std::string>() + "\n";
      }
    } else if (op == mcap::Op::kChunk) {
      fields.take(8 + 8 + 8 + 4);  // times, size, sum
      EXPECT_EQ(fields.text(), "");
      read_records({fields.take(fields.number(8))});
    } else if (op == mcap::Op::kAttachment) {
      fields.take(8 + 8);  // times
      const std::string name(fields.text());
      fields.text();
      files[name] = fields.take(fields.number(8));
    }
  }

  std::map<std::uint64_t, std::string> schemas_;
  std::map<std::uint64_t, std::string> channels_;  // their schemas
};

TEST(Mcap, HasTheContentsOfTheRecordingDirectory) {
  for (const bool ended : {true, false}) {
    const test::TempDirectory scratch;
    record(scratch.path("directory"), ended);
    record(scratch.path("file.mcap"), ended);
    const auto files = files_of(scratch.path("directory"));
    EXPECT_EQ(Contents(scratch.text_of("file.mcap")).files, files);
    EXPECT_EQ(files.size(), 6U);
    EXPECT_FALSE(files.at("frames.log").empty());
  }
}

TEST(Mcap, SameCallsMakeTheSameBytes) {
  const test::TempDirectory scratch;
  for (const char* name : {"a.mcap", "b.mcap"}) record(scratch.path(name), true);
  EXPECT_EQ(scratch.text_of("a.mcap"), scratch.text_of("b.mcap"));
}

TEST(Mcap, WhatIsThereAlreadyStays) {
  const test::TempDirectory scratch;
  scratch.put("a.mcap", "mine");
  EXPECT_THROW(record(scratch.path("a.mcap"), true), StartError);
  EXPECT_EQ(scratch.text_of("a.mcap"), "mine");
  EXPECT_THROW(record(scratch.path("none/a.mcap"), true), StartError);
}

// The check value of CRC-32/ISO-HDLC; in parts it is the same.
TEST(Mcap, SumsAreThoseOfZlib) {
  EXPECT_EQ(mcap::crc32("123456789"), 0xCBF43926U);
  EXPECT_EQ(mcap::crc32("6789", mcap::crc32("12345")), 0xCBF43926U);
}

}  // namespace mcap_test
}  // namespace lk::emulator
