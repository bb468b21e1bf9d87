// Faults of RS-485: incomplete packets, and effects of a port on its host.

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "tests/emulator/core/faults/link_support.hpp"
#include "tests/support/serial_bus.hpp"

namespace lk::emulator {
namespace serial_faults_test {

using test::bytes;
using test::hex;
using test::serial_bus;
using test::serial_drive;
using test::SerialHost;

constexpr std::string_view kState2Packet = "3E 9C 01 00 DB";

SerialHost with(const Fault& made, Generation generation = Generation::kV236) {
  SerialHost host(serial_bus({serial_drive(generation), serial_drive(generation, 2)}));
  host.bus.apply({kWholeBus, SetFault{made}});
  return host;
}

std::string healthy_reply() {
  SerialHost host(serial_drive(Generation::kV236));
  return host.ask(kState2Packet);
}

std::uint64_t effects(const SerialHost& host) { return host.bus.faults()[0].evidence.effects; }

bool is_packet(const std::string& text) {
  const auto read = bytes(text);
  const auto packet = protocol::packet_at(read);
  return packet && protocol::wire_bytes(*packet).size == read.size();
}

TEST(SerialFaults, BadChecksumChangesOnlyTheChecksum) {
  for (const bool header : {true, false}) {
    SerialHost host = with(fault("checksum_bad", {1}, {static_cast<FaultChoice>(header ? 0 : 1)}));
    const auto good = bytes(healthy_reply());
    const auto bad = bytes(host.ask(kState2Packet));
    ASSERT_EQ(bad.size(), good.size());
    const std::size_t sum = header ? 4 : bad.size() - 1;
    for (std::size_t n = 0; n < bad.size(); ++n) EXPECT_EQ(bad[n] != good[n], n == sum) << n;
    EXPECT_EQ(effects(host), 1U);
  }
  SerialHost echoed = with(fault("checksum_bad", {1}));
  EXPECT_EQ(echoed.ask("3E 88 01 00 C7"), "3E 88 01 00 C7");  // no data, no data sum
  EXPECT_EQ(effects(echoed), 0U);
}

TEST(SerialFaults, LostByteShortensTheReply) {
  SerialHost host = with(fault("byte_lost", {1}));
  const std::string good = healthy_reply();
  const std::string bad = host.ask(kState2Packet);
  std::vector<std::string> holed;
  for (std::size_t n = 0; n < bytes(good).size(); ++n) {
    std::string without = good + " ";
    without.erase(3 * n, 3);
    without.pop_back();
    holed.push_back(without);
  }
  EXPECT_NE(std::ranges::find(holed, bad), holed.end()) << bad;
  EXPECT_FALSE(is_packet(bad));
  EXPECT_EQ(effects(host), 1U);
}

TEST(SerialFaults, ByteGapPausesWithinTheReply) {
  SerialHost host = with(fault("byte_gap", {1}, {4}));
  const std::string good = healthy_reply();
  const SimTime begin = host.bus.time();
  host.write(begin, bytes(kState2Packet));
  const auto parts = host.read_until(begin + 20ms);
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(hex(parts[0].frame) + " " + hex(parts[1].frame), good);
  // 50 us of query and 150 us of reply time; ten bits per byte at 1 Mbit/s.
  EXPECT_EQ(parts[0].at, begin + 200us + 10us * parts[0].frame.dlc);
  EXPECT_EQ(parts[1].at, parts[0].at + 4ms + 10us * parts[1].frame.dlc);
  expect_balanced(host.bus, parts, "a pause");
}

TEST(SerialFaults, EchoReturnsTheBytesOfTheHost) {
  const std::string good = healthy_reply();
  SerialHost host = with(fault("echo", {}));
  EXPECT_EQ(host.ask(kState2Packet), std::string(kState2Packet) + " " + good);
  EXPECT_EQ(host.ask("3E 88 05 00 CB"), "3E 88 05 00 CB");  // an absent drive
  EXPECT_EQ(host.ask("00 FF 3E"), "00 FF 3E");
  EXPECT_EQ(effects(host), 3U);
  host.write(host.bus.time(), bytes(kState2Packet));
  const SimTime begin = host.bus.time();
  const auto read = host.read_until(begin + 20ms);
  ASSERT_EQ(read.size(), 2U);
  EXPECT_TRUE(read[0].echo);
  EXPECT_EQ(read[0].at, begin + 50us);  // when its last bit is sent
  EXPECT_FALSE(read[1].echo);
}

/// Observed on a real terminal with ICRNL, for 9 of 754 replies.
TEST(SerialFaults, CarriageReturnsBecomeLineFeeds) {
  SerialHost host = with(fault("cr_to_lf", {}), Generation::kLegacy);
  EXPECT_EQ(host.ask("3E 31 01 06 76 0D 64 32 28 32 32 2F"), "3E 31 01 06 76 0A 64 32 28 32 32 2F");
  EXPECT_EQ(effects(host), 1U);
  EXPECT_EQ(host.bus.servo(1).ram.gains.angle_kp, 13);  // bytes from the host are unchanged
  EXPECT_EQ(host.ask("3E 88 01 00 C7"), "3E 88 01 00 C7");
  EXPECT_EQ(effects(host), 1U);
  host.write(host.bus.time(), bytes("3E 30 01 00 6F"));
  const auto read = host.read_until(host.bus.time() + 20ms);
  ASSERT_EQ(read.size(), 1U);
  EXPECT_EQ(read[0].frame.kind, FrameKind::kBytes);
  EXPECT_EQ(read[0].drive_id, 1);  // the bytes do not identify the drive
}

/// The reply begins 150 us after the packet, at 10 us per byte. A driver that stays on for 200 us
/// spoils the first five bytes.
TEST(SerialFaults, LateReleaseDamagesTheStartOfTheReply) {
  SerialHost host = with(fault("late_release", {}, {200}));
  const std::string good = healthy_reply();
  const std::string bad = host.ask(kState2Packet);
  ASSERT_EQ(bad.size(), good.size());
  EXPECT_NE(bad.substr(0, 14), good.substr(0, 14));
  EXPECT_EQ(bad.substr(15), good.substr(15));
  EXPECT_EQ(effects(host), 1U);
  host.bus.apply({kWholeBus, ClearFault{"all"}});
  EXPECT_TRUE(is_packet(host.ask(kState2Packet)));
  SerialHost soon = with(fault("late_release", {}, {140}));
  EXPECT_TRUE(is_packet(soon.ask(kState2Packet)));
  EXPECT_EQ(effects(soon), 0U);
}

TEST(SerialFaults, TornReplyFailsItsChecksum) {
  constexpr double kCount_deg = 360.0 / 16384;
  SerialHost host = with(fault("torn_reply", {1}, {static_cast<FaultChoice>(2)}));
  host.ask(kState2Packet);
  EXPECT_TRUE(is_packet(host.ask(kState2Packet)));  // equal bytes
  host.bus.apply({1, TurnShaft{3 * kCount_deg}});
  host.bus.advance_to(host.bus.time() + 1ms);
  const std::string torn = host.ask(kState2Packet);
  EXPECT_EQ(bytes(torn).size(), 13U);
  EXPECT_FALSE(is_packet(torn)) << torn;
  EXPECT_EQ(effects(host), 1U);
  EXPECT_TRUE(is_packet(host.ask(kState2Packet)));
}

TEST(SerialFaults, WrongBitrateSilencesOnlyItsDrive) {
  SerialHost host = with(fault("wrong_bitrate", {2}));
  for (int n = 0; n < 20; ++n) EXPECT_TRUE(is_packet(host.ask(kState2Packet))) << n;
  EXPECT_EQ(host.ask("3E 9C 02 00 DC"), "");
  EXPECT_EQ(effects(host), 1U);
}

/// Configuration files refuse these faults on CAN.
TEST(SerialFaults, HaveNoEffectOnCan) {
  int tried = 0;
  for (const FaultRow& row : fault_table()) {
    if (!row.serial) continue;
    Rig rig(bus_config({1}, kBitrate));
    Fault made = fault_of(row);
    if (!row.of_bus) made.ids = {1};
    rig.set(made);
    EXPECT_EQ(rig.talk(kAsk, 10ms), std::vector<Frame>{kAnswer}) << row.word;
    EXPECT_EQ(rig.effects(), 0U) << row.word;
    ++tried;
  }
  EXPECT_GT(tried, 0);
}

void expect_all_silent_after_off(SerialHost& host) {
  EXPECT_EQ(host.ask("3E 80 01 00 BF"), "3E 80 01 00 BF");
  EXPECT_EQ(host.ask("3E 9C 02 00 DC"), "");
  EXPECT_EQ(host.ask(kState2Packet), "");
  host.bus.power_cycle(1);
  host.bus.advance_to(host.bus.time() + 1s);
  EXPECT_TRUE(is_packet(host.ask("3E 9C 02 00 DC")));
  EXPECT_TRUE(is_packet(host.ask(kState2Packet)));
}

TEST(SerialFaults, DriveHoldingTheLineAfterOffSilencesAllUntilARestart) {
  SerialHost host = with(fault("bus_held_after_off", {1}));
  expect_all_silent_after_off(host);
  EXPECT_EQ(effects(host), 2U);
  ServoConfig first = serial_drive(Generation::kV236);
  first.quirks.off_hangs = OffHangs::kBus;
  SerialHost always(serial_bus({first, serial_drive(Generation::kV236, 2)}));
  expect_all_silent_after_off(always);
}

TEST(SerialFaults, DriveCanBeSilentAloneAfterOff) {
  SerialHost host = with(fault("bus_held_after_off", {1}, {static_cast<FaultChoice>(0)}));
  host.ask("3E 80 01 00 BF");
  EXPECT_TRUE(is_packet(host.ask("3E 9C 02 00 DC")));
  EXPECT_EQ(host.ask(kState2Packet), "");
  EXPECT_EQ(effects(host), 1U);
}

}  // namespace serial_faults_test
}  // namespace lk::emulator
