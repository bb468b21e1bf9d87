// can-utils with the program: cansend, candump, and slcand, which turns a terminal into an
// interface.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/host/machine_support.hpp"
#include "tests/vcan/ready_emulator.hpp"

namespace lk::host {
namespace can_utils_test {

int candumps() { return count_of(text_of("/proc/net/can/rcvlist_all"), "vcan0"); }

TEST(CanUtils, CansendQueriesAndCandumpOutputDecodes) {
  ReadyEmulator emulator(on("vcan0", "1-2"));
  const int before = candumps();
  EmulatorProcess decode({"decode", "--json"},
                         {"sh", "-c", "candump -n 8 -t z vcan0 | exec \"$@\"", "sh"});
  ASSERT_TRUE(wait_until([before] { return candumps() == before + 1; }));
  Host host("vcan0");
  std::string all;  // all queries in order
  for (const char* query : {"141#9A00000000000000", "142#9200000000000000", "141#8800000000000000",
                            "142#A200000028230000"}) {
    ASSERT_TRUE(run(std::string("cansend vcan0 ") + query));
    ASSERT_TRUE(host.receive()) << query;
    const auto reply = host.receive();
    ASSERT_TRUE(reply) << query;
    EXPECT_EQ(reply->can_id, std::stoul(query, nullptr, 16));
    std::string text = std::string(query).substr(0, 4);
    for (const std::uint8_t byte : reply->data) {
      char digits[3];
      std::snprintf(digits, sizeof digits, "%02X", byte);
      text += digits;
    }
    EXPECT_EQ(text.substr(0, 6), std::string(query).substr(0, 6)) << "the same command";
    all += std::string(query) + ' ' + text + ' ';
  }
  const auto said = decode.wait();
  EXPECT_EQ(said.status, 0) << said.err;
  std::string decoded;
  const std::string key = "\"frame\":\"";
  for (auto at = said.out.find(key); at != std::string::npos; at = said.out.find(key, at + 1)) {
    const auto begin = at + key.size();
    decoded += said.out.substr(begin, said.out.find('"', begin) - begin) + ' ';
  }
  EXPECT_EQ(decoded, all) << said.out;
  EXPECT_NE(said.out.find("\"type\":\"summary\""), std::string::npos) << said.out;
  EXPECT_EQ(emulator.stop().status, 0);
}

TEST(CanUtils, SlcandCreatesAnInterfaceFromAPty) {
  if (!run("insmod /usr/lib/uml/modules/$(uname -r)/kernel/drivers/net/can/slcan/slcan.ko "
           "2>/dev/null || modprobe slcan 2>/dev/null || test -d /sys/module/slcan")) {
    GTEST_SKIP() << "no slcan in this kernel";
  }
  const test::TempDirectory own;
  const std::string terminal = own.path("ttyACM0");
  ReadyEmulator emulator({"--bus", "slcan-pty:" + terminal, "--ids", "1-4", "--rom", ":memory:"});
  // It becomes a daemon and needs no terminal.
  ASSERT_TRUE(run("slcand -o -s8 $(readlink " + terminal + ") canutils0"));
  ASSERT_TRUE(wait_until([] { return std::filesystem::exists("/sys/class/net/canutils0"); }));
  ASSERT_TRUE(run("ip link set canutils0 up"));
  {
    Host host("canutils0");
    for (int n = 0; n < 200; ++n) {
      const auto reply = host.query(1 + n % 4, {0x9A});
      ASSERT_TRUE(reply) << n;
      EXPECT_EQ((*reply)[0], 0x9A);
    }
  }
  const auto result = emulator.stop();
  EXPECT_EQ(result.status, 0);
  EXPECT_NE(result.out.find("200 queries, 200 replies"), std::string::npos) << result.out;
  EXPECT_TRUE(run("pkill -x slcand"));
}

}  // namespace can_utils_test
}  // namespace lk::host
