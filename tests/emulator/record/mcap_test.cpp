// A recording as MCAP is the directory that it would have been: unpacked, byte for byte. Whether it
// is MCAP, a reader of the tests' own says (tests/vcan/mcap_host.py).

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include "emulator/config/profile.hpp"
#include "emulator/ground/start_error.hpp"
#include "emulator/record/mcap_records.hpp"
#include "emulator/record/mcap_unpack.hpp"
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

TEST(Mcap, UnpackedIsTheDirectoryThatItWouldHaveBeen) {
  for (const bool ended : {true, false}) {
    const test::TempDirectory scratch;
    record(scratch.path("directory"), ended);
    record(scratch.path("file.mcap"), ended);
    fs::create_directory(scratch.path("unpacked"));
    unpack_mcap(scratch.path("file.mcap"), scratch.path("unpacked"));
    const auto files = files_of(scratch.path("directory"));
    EXPECT_EQ(files_of(scratch.path("unpacked")), files);
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

TEST(Mcap, ACutOrChangedFileIsReadToThereOrRefused) {
  const test::TempDirectory scratch;
  record(scratch.path("good.mcap"), true);
  const std::string good = scratch.text_of("good.mcap");
  const auto read = [&](const std::string& bytes) {
    fs::remove_all(scratch.path("out"));
    fs::create_directory(scratch.path("out"));
    unpack_mcap(scratch.put("bad.mcap", bytes), scratch.path("out"));
  };
  const auto tried = [&](const std::string& bytes) {
    try {
      read(bytes);
    } catch (const StartError& problem) {
      EXPECT_NE(std::string(problem.what()).find("bad.mcap: "), std::string::npos);
    }
  };
  for (std::size_t size = 0; size < good.size(); size += 401) tried(good.substr(0, size));
  for (std::size_t at = 8; at < good.size(); at += 211) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x41);
    tried(bad);
  }
}

TEST(Mcap, AttachmentsGoNowhereElse) {
  const test::TempDirectory scratch;
  for (const std::string name : {"../x.toml", "/tmp/x.toml", "motors/../x.toml", "rom/a/b.toml"}) {
    mcap::Content content;
    content.number(std::uint64_t{0}).number(std::uint64_t{0}).text(name).text("text/plain");
    content.number(std::uint64_t{1}).raw("x");
    content.number(mcap::crc32(content.bytes()));
    fs::remove_all(scratch.path("out"));
    fs::create_directory(scratch.path("out"));
    const std::string bytes =
        std::string(mcap::kMagic) + mcap::record(mcap::Op::kAttachment, content.bytes());
    EXPECT_THROW(unpack_mcap(scratch.put("bad.mcap", bytes), scratch.path("out")), StartError);
    EXPECT_EQ(files_of(scratch.path("out")).size(), 2U) << name;  // the logs
    EXPECT_EQ(scratch.names().size(), 2U) << name;
  }
}

}  // namespace mcap_test
}  // namespace lk::emulator
