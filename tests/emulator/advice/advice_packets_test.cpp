// Advice for hosts on RS-485, and none for correct ones.

#include <gtest/gtest.h>

#include "emulator/monitor/advice/host_watches.hpp"
#include "tests/emulator/advice/advice_support.hpp"
#include "tests/support/faults.hpp"
#include "tests/support/serial_bus.hpp"

namespace lk::emulator {
namespace advice_packets_test {

using test::serial_bus;
using test::serial_drive;

/// A host on RS-485, which writes bytes.
struct Wired : AnsweredHost {
  explicit Wired(Generation generation = Generation::kV236) : Wired(two_drives(generation)) {}
  explicit Wired(const BusConfig& config) : AnsweredHost(config) {}
  static BusConfig two_drives(Generation generation) {
    return serial_bus({serial_drive(generation), serial_drive(generation, 2)});
  }
  void write(std::string_view written) {
    std::vector<protocol::Frame> frames;
    protocol::append_frames(test::bytes(written), frames);
    for (const protocol::Frame& frame : frames) send(frame);
  }
  void write(int times, SimTime gap, std::string_view written) {
    for (int n = 0; n < times; ++n) {
      write(written);
      wait(gap);
    }
  }
};

TEST(AdvicePackets, WarnOnZeroWithoutPayload) {
  Wired host;
  host.write(2, 5ms, "3E 95 01 07 DB (8 x 00)");
  EXPECT_EQ(host.all(), "");
  host.write(2, 5ms, "3E 95 01 00 D4");
  EXPECT_EQ(host.count(AdviceKind::kZeroWithoutPayload), 2U);
  Wired older(Generation::kV235);  // its 0x95 has no payload
  older.write(2, 5ms, "3E 95 01 00 D4");
  EXPECT_EQ(older.all(), "");
}

/// docs/reference/rs485.md: 0x42 is V2.35's, 0x91 the oldest manual's, 0x89 no generation's. On CAN
/// 0x42 is v236b's, v235 has 0x91, and 0x89 is unused.
TEST(AdvicePackets, NameCommandsUnknownOnRs485) {
  Wired host;
  host.write(1, 5ms, "3E 42 01 07 88 97 32 00 14 00 00 00 DD");
  host.write(1, 5ms, "3E 91 01 02 D2 00 00 00");
  host.write(1, 5ms, "3E 89 01 00 C8");
  host.write(1, 5ms, "3E EE 01 00 2D");
  const auto& advice = host.adviser.advice();
  ASSERT_EQ(advice.size(), 4U) << host.all();
  EXPECT_EQ(what_text(advice[0], Language::kEnglish),
            "0x42, write setting to RAM: no answer, this drive does not have the command; it is "
            "one of v235");
  EXPECT_EQ(todo_text(advice[0], Language::kEnglish),
            "if the real drive has it, set setting_commands = true in its quirks, or choose a "
            "generation that has it; if not, do without");
  EXPECT_EQ(what_text(advice[1], Language::kEnglish),
            "0x91, write encoder offset to ROM: no answer, this drive does not have the command; "
            "it is one of legacy, late-legacy");
  EXPECT_EQ(what_text(advice[2], Language::kEnglish),
            "0x89, restore: no answer, this drive does not have the command, and no generation has "
            "it by default");
  EXPECT_EQ(todo_text(advice[2], Language::kEnglish),
            "if the real drive has it, set restore_command = true in its quirks; if not, do "
            "without");
  EXPECT_EQ(todo_text(advice[3], Language::kEnglish),
            "see the list of commands (docs/reference/rs485.md, Commands)");
}

/// Covers all commands that a drive lacks, in every generation: each text has a name.
TEST(AdvicePackets, NameEveryUnknownCommand) {
  for (std::size_t n = 0; n < protocol::kGenerationRows.size(); ++n) {
    const BusConfig bus = serial_bus({serial_drive(static_cast<Generation>(n))});
    const KnownDrive drive(bus.servos.front(), bus);
    for (const protocol::CommandInfo& command : protocol::serial_commands()) {
      if (protocol::knows(drive.format, command)) continue;
      Advice advice{.found = {}, .id = 1, .count = 1, .first = {}, .frame = {}};
      advice.frame.kind = protocol::FrameKind::kSerial;
      advice.frame.data[0] = static_cast<std::uint8_t>(command.opcode);
      advice.frame.dlc = 1;
      advice.found = unknown_command(advice.frame, drive);
      for (const Language language : {Language::kEnglish, Language::kChinese}) {
        const std::string line = advice_line("", advice, language);
        EXPECT_EQ(line.find("  "), std::string::npos) << line;
        EXPECT_EQ(line.find("， "), std::string::npos) << line;
        EXPECT_EQ(line.find("是 （"), std::string::npos) << line;
      }
      EXPECT_NE(what_text(advice, Language::kEnglish).find(command.name), std::string::npos);
    }
  }
}

/// Identifiers, 8 bytes and 1 Mbit/s are terms of CAN.
TEST(AdvicePackets, SuggestRs485RemediesOnly) {
  for (const AdviceRow& row : advice_table()) {
    if (row.kind == AdviceKind::kDuplicateId || row.kind == AdviceKind::kOtherGeneration ||
        row.kind == AdviceKind::kUnknownCommand || row.kind == AdviceKind::kFasterThanDrive) {
      continue;  // never given there, or with texts of their own
    }
    Advice advice{.found = {row.kind, nullptr}, .id = 1, .count = 1, .first = {}, .frame = {}};
    advice.frame.kind = protocol::FrameKind::kSerial;
    const std::string todo = todo_text(advice, Language::kEnglish);
    for (const char* const word :
         {"on CAN", "identifier", "Mbit/s", "0x280", "docs/reference/protocol.md"}) {
      EXPECT_EQ(todo.find(word), std::string::npos) << todo;
    }
  }
}

/// 0xA5 and 0x8C as the host misa-actuator sends them.
TEST(AdvicePackets, WarnOnCanPayloads) {
  Wired host;
  host.write(1, 5ms, "3E A5 01 07 EB 01 00 00 28 23 00 00 4C");
  EXPECT_EQ(host.count(AdviceKind::kCanPadding), 1U) << host.all();
  EXPECT_EQ(host.count(AdviceKind::kWrongLength), 0U);
  EXPECT_EQ(host.what(AdviceKind::kCanPadding), "0xA5 with LEN 7, which is CAN's");
  host.write(1, 5ms, "3E 8C 01 07 D2 10 00 00 00 00 00 00 10");
  host.write(1, 5ms, "3E 9A 01 07 E0 (8 x 00)");
  EXPECT_EQ(host.count(AdviceKind::kCanPadding), 3U);
  Wired right;
  right.write(1, 5ms, "3E 92 01 00 D1");
  right.write(2, 5ms, "3E A5 01 04 E8 01 28 23 00 4C");
  right.write(2, 5ms, "3E 8C 01 01 CC 10 10");
  right.write(2, 5ms, "3E C0 01 07 06 0A (6 x 00) 0A");  // correct: seven bytes
  EXPECT_EQ(right.all(), "");
  Wired short_of;
  short_of.write(1, 5ms, "3E A2 01 02 E3 A0 8C 2C");
  EXPECT_EQ(short_of.count(AdviceKind::kWrongLength), 1U);
}

/// The reply ends 230 us after an 0xA1 that ends 80 us after its start: 310 us at least.
TEST(AdvicePackets, WarnOnSendingDuringAReply) {
  const char* const torque = "3E A1 01 02 E2 64 00 64";
  BusConfig not_while_replying = Wired::two_drives(Generation::kV236);
  not_while_replying.serial->receives_while_replying = false;
  Wired host;
  host.write(1, 300us, torque);
  host.write(1, 20ms, "3E A1 02 02 E3 64 00 64");  // another drive on the same line
  host.write(1, 300us, torque);
  host.write(1, 20ms, torque);
  EXPECT_EQ(host.all(), "");
  host.write(1, 300us, torque);
  host.write(1, 20ms, torque);
  EXPECT_EQ(host.count(AdviceKind::kTalksOverReply, kWholeBus), 1U) << host.all();
  EXPECT_EQ(host.what(AdviceKind::kTalksOverReply, kWholeBus),
            "3 times a packet before the reply to the last was over: this one came 300 µs after "
            "it, and the reply ends 360 µs after it at the earliest");
  Wired at_once(not_while_replying);  // the drive owes a reply, and its queue has room
  for (int n = 0; n < 5; ++n) {
    at_once.write(torque);
    at_once.write(1, 20ms, torque);
  }
  EXPECT_GT(at_once.bus.stats().count(Drop::kDriveBusy), 0U);
  EXPECT_GT(at_once.count(AdviceKind::kTalksOverReply, kWholeBus), 0U);
  EXPECT_EQ(at_once.count(AdviceKind::kFasterThanDrive), 0U) << at_once.all();
  Wired waits;
  waits.write(500, 370us, torque);
  waits.write(20, 300us, "3E A1 05 02 E6 64 00 64");  // for an absent drive
  EXPECT_EQ(waits.count(AdviceKind::kTalksOverReply, kWholeBus), 0U) << waits.all();
}

/// The first reply begins 150 us after the first packet, which ends 80 us after its start.
TEST(AdvicePackets, IgnorePacketsBeforeTheReplyStarts) {
  const char* const torque = "3E A1 01 02 E2 64 00 64";
  Wired pair;
  for (int n = 0; n < 10; ++n) {
    pair.write(torque);
    pair.write(1, 20ms, "3E 92 01 00 D1");  // ends 130 us after the start
  }
  EXPECT_EQ(pair.bus.stats().queries, 20U);
  EXPECT_EQ(pair.all(), "");
  Wired early;  // the next packet overlaps the second reply
  for (int n = 0; n < 3; ++n) {
    early.write(torque);
    early.write(1, 400us, "3E 92 01 00 D1");
    early.write(1, 20ms, torque);
  }
  EXPECT_EQ(early.count(AdviceKind::kTalksOverReply, kWholeBus), 1U) << early.all();
  Wired third;  // is on the line when the first reply begins
  for (int n = 0; n < 5; ++n) {
    third.write(torque);
    third.write(torque);
    third.write(1, 20ms, torque);
  }
  EXPECT_GT(third.count(AdviceKind::kTalksOverReply, kWholeBus), 0U);
  Wired two;  // replies that collide
  for (int n = 0; n < 5; ++n) {
    two.write("3E 92 01 00 D1");
    two.write(1, 20ms, "3E 92 02 00 D2");
  }
  EXPECT_GT(two.count(AdviceKind::kTalksOverReply, kWholeBus), 0U);
}

TEST(AdvicePackets, WarnOnEchoTakenForAReply) {
  Wired host;
  host.bus.apply({kWholeBus, SetFault{test::fault_of("echo")}});
  host.wait(2ms);
  for (int n = 0; n < 3; ++n) {
    host.write(1, 100us, "3E 88 01 00 C7");  // takes 50 us itself
    host.write(1, 20ms, "3E 9C 01 00 DB");
  }
  EXPECT_EQ(host.count(AdviceKind::kEchoTaken, kWholeBus), 1U) << host.all();
  EXPECT_EQ(host.count(AdviceKind::kTalksOverReply, kWholeBus), 0U);
}

/// 0xFF % 0xFF is 0, and 0x1A8 % 0xFF is 0xA9.
TEST(AdvicePackets, WarnOnChecksumsModulo255) {
  Wired header;
  header.write(2, 5ms, "3E A4 1C 01 00 00 00");  // 3E + A4 + 1C + 01 = FF: 0 by 255
  EXPECT_EQ(header.all(), "");
  header.write(2, 5ms, "3E A4 1C 01 00 00 00");
  EXPECT_EQ(header.count(AdviceKind::kSumWrong, kWholeBus), 2U);
  Wired data;
  data.write(3, 5ms, "3E A1 01 02 E2 FF 64 64");  // 163: 64 by 255, 63 by 256
  EXPECT_EQ(data.what(AdviceKind::kSumWrong, kWholeBus),
            "the sum of the data is the remainder of a division by 255");
  Wired both;
  both.write(3, 5ms, "3E A1 01 02 E2 64 00 46");  // E2 + 64 = 146
  EXPECT_EQ(both.what(AdviceKind::kSumWrong, kWholeBus),
            "the sum of the data counts the header in");
  Wired noise;
  for (int n = 0; n < 300; ++n) {
    noise.write(1, 5ms, n % 2 == 0 ? "3E A1 01 02 E2 64 00 65" : "3E 9C 01 00 DA");
  }
  EXPECT_EQ(noise.all(), "");
}

TEST(AdvicePackets, IgnorePollsOfTwoPresentDrives) {
  Wired host;
  for (int n = 0; n < 400; ++n) {
    host.write(1, 5ms, "3E 9C 01 00 DB");
    host.write(1, 5ms, "3E 9C 02 00 DC");
  }
  EXPECT_EQ(host.all(), "");
}

TEST(AdvicePackets, IgnoreUnsavedRamWrites) {
  Wired host(Generation::kV235);
  host.write(1, 5ms, "3E 42 01 07 88 97 32 00 14 00 00 00 DD");
  host.write(10, 20ms, "3E 9C 01 00 DB");
  host.bus.power_cycle(1);
  host.wait(1s);
  host.write(300, 20ms, "3E 9C 01 00 DB");
  EXPECT_EQ(host.all(), "");
}

TEST(AdvicePackets, WarnOnTerminalNotInRawMode) {
  Wired host;
  const TimedFrame in{host.bus.time(), test::packet("3E 9C 01 00 DB")};
  host.adviser.on_query(in);
  host.adviser.on_terminal_flags({TerminalFlag::kIcrnl, TerminalFlag::kIxon}, in);
  EXPECT_EQ(host.count(AdviceKind::kTtyNotRaw, kWholeBus), 2U);
  EXPECT_EQ(host.what(AdviceKind::kTtyNotRaw, kWholeBus),
            "ICRNL is set: a 0x0D in a reply arrives as 0x0A, and its sum is wrong");
  Wired raw;
  raw.adviser.on_terminal_flags({}, in);
  EXPECT_EQ(raw.all(), "");
}

}  // namespace advice_packets_test
}  // namespace lk::emulator
