// Captures byte by byte, by hand from the two documents that pcapng.hpp names.

#include "emulator/monitor/scenario/pcapng.hpp"

#include <gtest/gtest.h>

#include <array>
#include <charconv>
#include <string_view>

#include "tests/support/frames.hpp"
#include "tests/support/serial.hpp"

namespace lk::emulator {
namespace pcapng_test {

/// Parses hexadecimal digits with spaces.
std::string bytes(std::string_view text) {
  std::string out;
  for (std::size_t n = 0; n < text.size(); n += 2) {
    if (text[n] == ' ') ++n;
    unsigned value = 0;
    std::from_chars(text.data() + n, text.data() + n + 2, value, 16);
    out += static_cast<char>(value);
  }
  return out;
}

/// A v235 drive of the MG series, and a legacy one of the MF series.
CapturedBus bus_of(const char* interface) {
  BusConfig bus;
  bus.interface = interface;
  bus.servos.resize(2);
  bus.servos[0].id = 1;
  bus.servos[0].generation = Generation::kV235;
  bus.servos[0].profile.series = Series::kMg;
  bus.servos[1].id = 12;
  return CapturedBus(bus);
}

TEST(Pcapng, BeginsWithItsInterfaces) {
  const std::array buses{bus_of("vcan0")};
  EXPECT_EQ(
      pcapng_begin(buses),
      bytes("0A0D0D0A 1C000000 4D3C2B1A 0100 0000 FFFFFFFFFFFFFFFF 1C000000"
            // LINKTYPE_CAN_SOCKETCAN; if_name "vcan0"
            "01000000 58000000 E300 0000 00000000 0200 0500 7663616E30000000"
            // if_description "LK-TECH drives: 1 v235 MG, 12 legacy MF"
            "0300 2700 4C4B2D54454348206472697665733A20312076323335204D472C203132206C6567616379"
            "204D4600"
            // if_tsresol 10^-9; the end
            "0900 0100 09000000 0000 0000 58000000"));
}

TEST(Pcapng, EncodesFramesAsSocketCan) {
  // 5 s are 0x1_2A05F200 ns; outbound.
  EXPECT_EQ(pcapng_frame(0, std::chrono::seconds(5), test::frame("141#9C0102030405 0607"), true),
            bytes("06000000 3C000000 00000000 01000000 00F2052A 10000000 10000000"
                  "00000141 08 00 0000 9C01020304050607 0200 0400 02000000 0000 0000 3C000000"));
  // Three bytes on the second bus, padded; inbound.
  EXPECT_EQ(pcapng_frame(1, SimTime{0}, test::frame("181#9C0102"), false),
            bytes("06000000 38000000 01000000 00000000 00000000 0B000000 0B000000"
                  "00000181 03 00 0000 9C010200 0200 0400 01000000 0000 0000 38000000"));
}

TEST(Pcapng, StoresRs485BytesUnchanged) {
  const std::array buses{bus_of("rs485:/a")};
  // LINKTYPE_USER0, 147 = 0x93.
  EXPECT_EQ(pcapng_begin(buses).substr(28, 12), bytes("01000000 58000000 9300 0000"));
  EXPECT_EQ(pcapng_frame(0, SimTime{0}, test::packet("3E9A0100D9"), true).substr(20, 16),
            bytes("05000000 05000000 3E9A0100D9 000000"));
}

TEST(Pcapng, EncodesTheKindOfFrame) {
  const auto packet = [](const protocol::Frame& frame) {
    return pcapng_frame(0, SimTime{0}, frame, true).substr(28, 8);
  };
  EXPECT_EQ(packet(test::frame("141#R")), bytes("40000141 00 00 0000"));
  EXPECT_EQ(packet(test::frame("00000141#")), bytes("80000141 00 00 0000"));
  protocol::Frame fd = test::frame("141#");
  fd.kind = protocol::FrameKind::kFd;
  EXPECT_EQ(packet(fd), bytes("00000141 00 04 0000"));
}

}  // namespace pcapng_test
}  // namespace lk::emulator
