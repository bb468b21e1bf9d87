// The lines about drives in the program's start-up output.

#include <gtest/gtest.h>

#include "tests/host/emulator_process.hpp"
#include "tests/host/host.hpp"

namespace lk::host {
namespace drive_test {

unsigned uint16_at(const Payload& data, std::size_t at) { return data[at] + 256U * data[at + 1]; }

// A host for an MG4010 reads 0x94 as uint32 at 4–7 in 0.01° of the rotor; ±2048 is ±33 A.
TEST(SeenGeneration, ReportsAndUsesTheObservedGeneration) {
  const auto single_turn_deg = [](Host& host) {
    const Payload data = host.query(1, {0x94}).value_or(Payload{});
    return (uint16_at(data, 4) + 65536.0 * uint16_at(data, 6)) / 100;
  };
  const auto encoder_deg = [](Host& host) {  // the field spans an output turn, ten of the rotor
    return uint16_at(host.query(1, {0x90}).value_or(Payload{}), 2) * 3600.0 / 65536;
  };
  const std::vector<std::string> plain = {"--bus",   own_bus(), "--ids", "1",
                                          "--motor", "mg4010",  "--rom", ":memory:"};
  const std::string note =
      "mg4010: real drives of this motor use generation late-legacy, this one uses legacy "
      "(--generation seen changes that)\n";
  {
    StartedEmulator emulator(plain);
    Host host(own_bus());
    EXPECT_GT(single_turn_deg(host), 3600);
    const auto result = emulator.stop();
    EXPECT_NE(result.err.find(note), std::string::npos) << result.err;
  }
  auto asked = plain;
  asked.insert(asked.end(), {"--generation", "legacy"});
  {
    StartedEmulator emulator(asked);
    const auto result = emulator.stop();
    EXPECT_EQ(result.err.find("real drives of this motor use"), std::string::npos) << result.err;
  }
  asked.back() = "seen";
  StartedEmulator emulator(asked);
  Host host(own_bus());
  EXPECT_LT(single_turn_deg(host), 3600);
  EXPECT_NEAR(single_turn_deg(host), encoder_deg(host), 2 * 3600.0 / 65536);
  const auto state = host.query(1, {0x9A});
  ASSERT_TRUE(state);
  EXPECT_NEAR(uint16_at(*state, 3) * 0.1, 24.0, 0.5);
  EXPECT_EQ(host.query(1, {0x9B}).value_or(Payload{})[0], 0x9B);
  const auto result = emulator.stop();
  EXPECT_EQ(result.err.find("real drives of this motor use"), std::string::npos) << result.err;
}

}  // namespace drive_test
}  // namespace lk::host
