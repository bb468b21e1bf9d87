// Every configuration that is delivered runs: a simulated second, then every drive is asked how it
// is.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "emulator/bus.hpp"
#include "emulator/config.hpp"
#include "tests/support/frames.hpp"
#include "tests/support/profile.hpp"

namespace lk::emulator {
namespace {

using namespace std::chrono_literals;

std::vector<BusConfig> robot(const std::string& name) {
  const std::string file = std::string(LKEMU_SOURCE_DIR) + "/configs/buses/" + name + ".toml";
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return parse_config(text.str(), file, {}, test::profile);
}

/// The one reply to a query.
protocol::Frame ask(Bus& bus, const ServoConfig& servo, const protocol::Payload& payload) {
  protocol::Frame query;
  query.id = 0x140U + static_cast<std::uint32_t>(servo.id);
  query.dlc = 8;
  query.data = payload;
  bus.receive({bus.time(), query});
  bus.advance_to(bus.time() + 2ms);
  std::vector<TimedFrame> replies;
  bus.take_replies(replies);
  EXPECT_EQ(replies.size(), 1U) << "drive " << servo.id;
  return replies.empty() ? protocol::Frame{} : replies[0].frame;
}

/// Multi-turn angle by 0x92, 0.01°, of the low 32 bits: nothing here turns further.
std::int32_t angle_cdeg(Bus& bus, const ServoConfig& servo) {
  const auto reply = ask(bus, servo, {0x92});
  std::uint32_t bits = 0;
  for (std::size_t k = 4; k >= 1; --k) bits = bits << 8U | reply.data[k];
  return static_cast<std::int32_t>(bits);
}

/// 0xA4: there with at most 100 °/s.
void go_to(Bus& bus, const ServoConfig& servo, std::int32_t target_cdeg) {
  const auto bits = static_cast<std::uint32_t>(target_cdeg);
  protocol::Payload payload{0xA4, 0, 100, 0};
  for (std::size_t k = 0; k < 4; ++k) {
    payload[4 + k] = static_cast<std::uint8_t>(bits >> 8U * k);
  }
  ask(bus, servo, payload);
}

bool finite(const model::Truth& truth) {
  for (const double value :
       {truth.theta_m, truth.omega_m, truth.theta_out, truth.omega_out, truth.i_d, truth.i_q,
        truth.v_bus, truth.temp_winding, truth.temp_housing, truth.temp_stage}) {
    if (!std::isfinite(value)) return false;
  }
  return true;
}

class Robot : public testing::TestWithParam<const char*> {};

TEST_P(Robot, RunsASecondWithoutErrors) {
  for (const BusConfig& config : robot(GetParam())) {
    Bus bus(config);
    bus.advance_to(1s);
    for (const ServoConfig& servo : config.servos) {
      SCOPED_TRACE(config.interface + " drive " + std::to_string(servo.id));
      const std::uint32_t id =
          servo.quirks.dialect.reply_id_base + static_cast<std::uint32_t>(servo.id);
      for (const std::uint8_t command : std::initializer_list<std::uint8_t>{0x9A, 0x9C, 0x92}) {
        const auto reply = ask(bus, servo, {command});
        EXPECT_EQ(reply.id, id);
        EXPECT_EQ(reply.data[0], command);
        if (command == 0x9A) {
          EXPECT_EQ(reply.data[7], 0) << "errorState";
        }
      }
      EXPECT_EQ(bus.telemetry(servo.id).errors, 0);
      EXPECT_TRUE(bus.telemetry(servo.id).bridge_on);
      const model::Truth truth = bus.truth(servo.id);
      EXPECT_TRUE(finite(truth));
      const double stop_give_rad = 0.05;  // assumed: the stops are springs
      EXPECT_GE(truth.theta_out, servo.profile.drive.load.theta_min - stop_give_rad);
      EXPECT_LE(truth.theta_out, servo.profile.drive.load.theta_max + stop_give_rad);
    }
  }
}

TEST_P(Robot, MovesEveryShaftToItsTarget) {
  for (const BusConfig& config : robot(GetParam())) {
    Bus bus(config);
    bus.advance_to(200ms);
    std::vector<std::pair<const ServoConfig*, std::int32_t>> targets;
    for (const ServoConfig& servo : config.servos) {
      if (servo.profile.drive.brake.tau > 0) continue;  // nobody released it
      targets.emplace_back(&servo, angle_cdeg(bus, servo) + 1500);
      go_to(bus, servo, targets.back().second);
    }
    bus.advance_to(4s);
    for (const auto& [servo, target_cdeg] : targets) {
      EXPECT_NEAR(angle_cdeg(bus, *servo), target_cdeg, 30)
          << config.interface << " drive " << servo->id;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Config, Robot,
                         testing::Values("bench", "example", "gimbal", "quadruped", "turntable"),
                         [](const auto& name) { return std::string(name.param); });

TEST(Robots, AreAllTested) {
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(LKEMU_SOURCE_DIR "/configs/buses")) {
    if (entry.path().extension() == ".toml") ++files;
  }
  EXPECT_EQ(files, 5U) << "name the new one above";
}

}  // namespace
}  // namespace lk::emulator
