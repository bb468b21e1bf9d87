// How the program ends, and with which rights it runs.

#include <gtest/gtest.h>

#include <csignal>

#include "tests/host/emulator_process.hpp"
#include "tests/host/host.hpp"

namespace lk::host {
namespace stop_test {

TEST(Stop, SignalsEndTheProgramWithASummary) {
  for (const int number : {SIGTERM, SIGINT}) {
    EmulatorProcess emulator({"--rom", ":memory:", "--bus", own_bus(), "--ids", "1-4"});
    ASSERT_TRUE(emulator.wait_ready());
    Host host(own_bus());
    EXPECT_TRUE(host.query(3, {0x9C}));
    const auto result = emulator.stop(number);
    EXPECT_EQ(result.status, 0);
    EXPECT_NE(result.out.find("lk-emu stopped after"), std::string::npos);
    EXPECT_NE(result.out.find(" 1 frames, 1 queries, 1 replies"), std::string::npos) << result.out;
  }
}

TEST(Privileges, NoneIsLeftWhoeverStartsTheProgram) {
  EmulatorProcess emulator({"--rom", ":memory:", "--bus", own_bus(), "--ids", "1"});
  ASSERT_TRUE(emulator.wait_ready());
  auto status = process_status(emulator.pid());
  for (const char* set : {"CapInh", "CapPrm", "CapEff", "CapAmb"}) {
    EXPECT_EQ(status[set], "0000000000000000") << set;
  }
  EXPECT_EQ(status["NoNewPrivs"], "1");
}

}  // namespace stop_test
}  // namespace lk::host
