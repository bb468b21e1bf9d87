// Runs every delivered configuration with its events, queries every drive, and checks that its
// current settles after a move.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "emulator/config/config.hpp"
#include "emulator/core/bus/bus.hpp"
#include "emulator/core/servo/registers.hpp"
#include "model/drive_bank.hpp"
#include "tests/support/frames.hpp"
#include "tests/support/robot.hpp"

namespace lk::emulator {
namespace robots_test {

using namespace std::chrono_literals;
using test::robot;

bool is_serial(const ServoConfig& servo) {
  return servo.quirks.dialect.framing == protocol::Framing::kSerial;
}

/// Returns the only reply to a query.
protocol::Frame ask(Bus& bus, const ServoConfig& servo, const protocol::Payload& payload) {
  protocol::Frame query;
  query.id = 0x140U + static_cast<std::uint32_t>(servo.id);
  query.dlc = protocol::kCanBytes;
  query.data = payload;
  if (is_serial(servo)) {
    query.kind = protocol::FrameKind::kSerial;
    query.dlc = payload[0] == 0xA4 ? 13 : 1;
  }
  bus.receive({bus.time(), query});
  bus.advance_to(bus.time() + 2ms);
  std::vector<TimedFrame> replies;
  bus.take_replies(replies);
  EXPECT_EQ(replies.size(), 1U) << "drive " << servo.id;
  return replies.empty() ? protocol::Frame{} : replies[0].frame;
}

/// Returns the multi-turn angle by 0x92 in 0.01°: the low 32 bits, which suffice here.
std::int32_t angle_cdeg(Bus& bus, const ServoConfig& servo) {
  const auto reply = ask(bus, servo, {0x92});
  std::uint32_t bits = 0;
  for (std::size_t k = 4; k >= 1; --k) bits = bits << 8U | reply.data[k];
  return static_cast<std::int32_t>(bits);
}

/// Sends 0xA4: moves to the target with at most 100 °/s.
void go_to(Bus& bus, const ServoConfig& servo, std::int32_t target_cdeg) {
  const auto bits = static_cast<std::uint32_t>(target_cdeg);
  protocol::Payload payload{0xA4, 0, 100, 0};
  std::size_t at = 4;
  if (is_serial(servo)) {  // an int64 of 0.01°, and 10000 = 0x2710 of 0.01 dps
    payload = {0xA4, 0, 0, 0, 0, 0, 0, 0, 0, 0x10, 0x27};
    at = 1;
    if (target_cdeg < 0) std::fill_n(payload.begin() + 5, 4, std::uint8_t{0xFF});
  }
  for (std::size_t k = 0; k < 4; ++k) {
    payload[at + k] = static_cast<std::uint8_t>(bits >> 8U * k);
  }
  ask(bus, servo, payload);
}

bool finite(const model::Truth& truth) {
  const std::array values = {
      truth.theta_m, truth.omega_m, truth.theta_out,    truth.omega_out,    truth.i_d,
      truth.i_q,     truth.v_bus,   truth.temp_winding, truth.temp_housing, truth.temp_stage};
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}

class Robot : public testing::TestWithParam<const char*> {};

/// The drive answers, is between its stops, and has no error.
void expect_well(Bus& bus, const ServoConfig& servo) {
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

TEST_P(Robot, RunsThroughItsEventsWithoutErrors) {
  for (const BusConfig& config : robot(GetParam())) {
    Bus bus(config);
    bus.advance_to(1s);
    for (const ServoConfig& servo : config.servos) {
      SCOPED_TRACE(config.interface + " drive " + std::to_string(servo.id));
      expect_well(bus, servo);
    }
    for (const TimedDirective& event : config.events) {
      bus.advance_to(event.at + 10ms);
      for (const ServoConfig& servo : config.servos) EXPECT_TRUE(finite(bus.truth(servo.id)));
    }
    // A power cycle and a supply ramp take a while.
    if (!config.events.empty()) bus.advance_to(config.events.back().at + 3s);
    EXPECT_EQ(bus.time() > 5s, !config.events.empty()) << "the events were executed";
    for (const ServoConfig& servo : config.servos) {
      SCOPED_TRACE(config.interface + " drive " + std::to_string(servo.id) + " at the end");
      expect_well(bus, servo);
    }
  }
}

TEST_P(Robot, MovesEveryShaftToItsTarget) {
  for (const BusConfig& config : robot(GetParam())) {
    Bus bus(config);
    bus.advance_to(200ms);
    std::vector<std::pair<const ServoConfig*, std::int32_t>> targets;
    for (const ServoConfig& servo : config.servos) {
      if (servo.profile.drive.brake.tau > 0) {
        EXPECT_EQ(ask(bus, servo, {0x8C, 0x01}).data[1], 1) << "released";
        bus.advance_to(bus.time() + 100ms);
      }
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

// --- settling

/// Returns the current for the rated torque; without a rating, a tenth of the sensor range.
double rated_current_A(const Profile& profile) {
  const model::DriveParams& d = profile.drive;
  const double k_t = 1.5 * d.motor.pole_pairs * d.motor.psi_f;
  const double tau = profile.rating.torque_rated_Nm;
  return tau > 0 ? tau / (d.mechanics.gear_ratio * d.mechanics.gear_efficiency * k_t)
                 : 0.1 * d.current_sensor.range;
}

/// Returns the peak-to-peak current in A, one second after a target step of the output. Without
/// sensor noise, which exists before the step too.
double ripple_after_step_A(const ServoConfig& servo, double step_deg) {
  model::DriveInit init{servo.profile.drive, control_settings(servo.rom), 1, 0.0};
  model::DriveParams& d = init.params;
  d.encoder.noise = d.current_sensor.noise = 0.0;
  d.brake.tau = 0.0;
  const double rad = std::numbers::pi / 180;
  init.theta_m = servo.boot_angle_deg.value_or(0.0) * rad;
  model::DriveBank bank(std::span(&init, 1));
  const auto f = static_cast<std::int64_t>(d.inverter.f_pwm);
  bank.advance(f / 2);           // a joint falls to its resting position
  const double clear = 1 * rad;  // of the end stops
  const double target = std::clamp(bank.truth(0).theta_out + step_deg * rad,
                                   d.load.theta_min + clear, d.load.theta_max - clear);
  bank.command(0, model::Position{target * d.mechanics.gear_ratio});
  bank.advance(f);
  double low = bank.truth(0).i_q;
  double high = low;
  for (std::int64_t n = 0; n < f / 4; n += 5) {  // 5 periods: not a multiple of the loops' periods
    bank.advance(5);
    low = std::min(low, bank.truth(0).i_q);
    high = std::max(high, bank.truth(0).i_q);
  }
  return high - low;
}

TEST_P(Robot, SettlesWithinASecondAfterAStep) {
  for (const BusConfig& bus : robot(GetParam())) {
    for (const ServoConfig& servo : bus.servos) {
      for (const double step_deg : {1.0, 10.0, -30.0}) {
        EXPECT_LT(ripple_after_step_A(servo, step_deg), 0.05 * rated_current_A(servo.profile))
            << bus.interface << " drive " << servo.id << ", step of " << step_deg << " deg";
      }
    }
  }
}

// --- all robots

TEST(Robots, BenchObeysPowerAndBrakeCommands) {
  const BusConfig config = robot("bench")[0];
  Bus bus(config);
  bus.advance_to(100ms);
  ask(bus, config.servos[0], {0xA0, 0, 0, 0, 0xF4, 0x01});  // half power
  bus.advance_to(1s);
  EXPECT_NEAR(bus.telemetry(1).power, 0.5, 0.01);
  const ServoConfig& braked = config.servos[4];
  const double before_rad = bus.truth(braked.id).theta_m;
  ask(bus, braked, {0xA1, 0, 0, 0, 0x40, 0});  // 1 A
  bus.advance_to(bus.time() + 200ms);
  EXPECT_NEAR(bus.truth(braked.id).theta_m, before_rad, 0.01) << "the brake holds it";
  ask(bus, braked, {0x8C, 0x01});
  bus.advance_to(bus.time() + 200ms);
  EXPECT_GT(bus.truth(braked.id).theta_m, before_rad + 0.5);
}

INSTANTIATE_TEST_SUITE_P(Config, Robot,
                         testing::Values("bench", "example", "gimbal", "mixed", "quadruped",
                                         "turntable"),
                         [](const auto& name) { return std::string(name.param); });

TEST(Robots, AllConfigurationsAreTested) {
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(LKEMU_SOURCE_DIR "/configs/buses")) {
    if (entry.path().extension() != ".toml") continue;
    // tests/bodies runs robots with a body.
    if (test::text_of_robot(entry.path().stem()).find("\n[body]\n") == std::string::npos) ++files;
  }
  EXPECT_EQ(files, 6U) << "name the new one above";
}

}  // namespace robots_test
}  // namespace lk::emulator
