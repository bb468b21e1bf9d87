// Faults of sensors, power stage, mechanics and supply: the values that they set in the model, and
// effects on readings of a host.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <string_view>
#include <vector>

#include "emulator/core/faults/acts.hpp"
#include "tests/emulator/core/faults/fault_support.hpp"

namespace lk::emulator {
namespace plant_faults_test {

using model::Error;
using namespace std::chrono_literals;
using test::answers;
using test::clear;
using test::evidence;
using test::expect_shown;
using test::Host;
using test::inject;

enum Channel { kA, kB, kBoth };
enum Sensor { kMotor, kDriver };

constexpr double kRotorInertia_kgm2 = 933e-7;  // of the test drive

double omega(const Host& host) { return host.bus.truth(1).omega_out; }
double dps(const Host& host) { return omega(host) / std::numbers::pi * 180; }

Host with_load(double J_kgm2) {
  ServoConfig config = test::servo_config(1);
  config.profile.drive.load.J = J_kgm2;
  return Host(config);
}

void speed(Host& host, double dps) { host.get<protocol::State2>(protocol::Speed{dps, 0}); }

// --- values of the model: tests/model/*_faults_test.cpp show what they do

TEST(PlantFaultRows, SetTheFaultsOfTheModel) {
  using F = model::Faults;
  using Legs = std::array<model::LegFault, 3>;
  using enum model::LegFault;
  using E = model::EncoderFault;
  enum Phase { kPhaseA, kPhaseB, kPhaseC };
  enum Side { kHigh, kLow };
  constexpr double kRad = std::numbers::pi / 180;
  constexpr auto kHealthyLeg = kNone;
  struct Row {
    const char* word;
    std::vector<FaultValue> values;
    F expected;
    SimTime active = 0ns;
  };
  const Row rows[] = {
      {"encoder_stuck", {}, {.encoder = E::kStuck}},
      {"encoder_jump", {10}, {.encoder_offset = 10 * kRad}},
      {"encoder_noise", {2}, {.encoder_noise = 2 * kRad}},
      {"encoder_drift", {36}, {.encoder_offset = 36 * kRad * 0.5}, 500ms},
      {"encoder_garbage", {}, {.encoder = E::kGarbage}},
      {"encoder_lost_magnet", {}, {.encoder = E::kLostMagnet}},
      {"encoder_slow", {10}, {.encoder_latency = 0.01}},
      {"current_offset", {2, kA}, {.current_a = {.offset = 2}}},
      {"current_offset", {2, kB}, {.current_b = {.offset = 2}}},
      {"current_gain", {0.5, kBoth}, {.current_a = {.gain = 0.5}, .current_b = {.gain = 0.5}}},
      {"current_noise", {0.5}, {.current_noise = 0.5}},
      {"current_stuck", {3, kB}, {.current_b = {.stuck = 3}}},
      {"temperature_stuck", {120, kMotor}, {.temp_motor_stuck = 120}},
      {"temperature_stuck", {90, kDriver}, {.temp_driver_stuck = 90}},
      {"temperature_off", {-40, kMotor}, {.temp_motor_offset = -40}},
      {"temperature_off", {15, kDriver}, {.temp_driver_offset = 15}},
      {"voltage_stuck", {4}, {.v_bus_stuck = 4}},
      {"voltage_off", {3}, {.v_bus_offset = 3}},
      {"phase_open", {kPhaseA}, {.legs = Legs{kPhaseOpen}}},
      {"switch_open", {kPhaseA, kHigh}, {.legs = Legs{kHighOpen}}},
      {"switch_open", {kPhaseC, kLow}, {.legs = Legs{kHealthyLeg, kHealthyLeg, kLowOpen}}},
      {"switch_shorted", {kPhaseB, kHigh}, {.legs = Legs{kHealthyLeg, kHighShorted}}},
      {"switch_shorted", {kPhaseA, kLow}, {.legs = Legs{kLowShorted}}},
      {"bridge_dead", {}, {.bridge_dead = true}},
      {"calibration_lost", {60}, {.commutation_offset = 60 * kRad}},
      {"jam", {50}, {.jam = 0.5}},
      {"friction", {4}, {.friction = 4}},
      {"inertia", {3}, {.inertia = 3}},
      {"backlash", {3}, {.backlash = 3}},
      {"load_step", {0.1}, {.load_torque = 0.1}},
      {"coupling_broken", {}, {.coupling_broken = true}},
      {"end_stop", {-90, 180}, {.theta_min = 0.7 - 90 * kRad, .theta_max = 0.7 + 180 * kRad}},
      {"brake_late", {100}, {.brake_delay = 0.1}},
      {"fan_stuck", {4}, {.R_housing_ambient = 4}},
      {"sag", {10}, {.v_source_max = 10}},
      {"dip", {1}, {.v_source_max = 4}},  // a volt below the reset threshold
      {"cut", {}, {.supply_cut = true}},
      {"reboot_loop", {600, 200}, {.supply_cut = true}, 599ms},
      {"reboot_loop", {600, 200}, {}, 600ms},
      {"no_regeneration", {}, {.no_regeneration = true}},
      {"clock_drift", {10}, {.clock_ratio = 1.1}},
  };
  const ServoConfig servo = test::powered_drive();
  std::set<std::string_view> words;
  for (const Row& row : rows) {
    LiveFault live;
    live.fault = test::fault(row.word, row.values);
    live.anchors = {0.7};
    F sum;
    live.row().plant({live, servo, row.active}, sum);
    EXPECT_EQ(sum, row.expected) << row.word;
    words.insert(row.word);
  }
  for (const FaultRow& row : fault_table()) {
    EXPECT_EQ(words.contains(row.word), row.plant != nullptr) << row.word;
  }
}

// --- mechanics

TEST(MechanicsFaults, JamHoldsTheShaftAndTripsTheStallProtection) {
  for (const bool watched : {false, true}) {
    ServoConfig config = test::servo_config(1);
    config.quirks.dialect.all_error_bits = true;
    config.rom.protections[static_cast<std::size_t>(model::Error::kStall)] = {watched, 0.3, 0, 0};
    config.rom.max_torque_current_lsb = 100;
    Host host(config);
    speed(host, 180);
    host.wait(300ms);
    EXPECT_NEAR(dps(host), 180, 5);
    inject(host, "jam", {100}, {.duration = 1s});
    host.wait(20ms);
    EXPECT_EQ(omega(host), 0.0);
    expect_shown(evidence(host), 300ms);
    host.wait(900ms);
    EXPECT_EQ(omega(host), 0.0);
    EXPECT_EQ(host.get<protocol::State1>(protocol::ReadState1{}).errors,
              watched ? model::bit(model::Error::kStall) : 0U);
    EXPECT_EQ(host.bus.telemetry(1).bridge_on, !watched);
    host.wait(1s);
    EXPECT_NEAR(dps(host), watched ? 0 : 180, 5);
  }
}

TEST(MechanicsFaults, KickChangesTheSpeedAtOnce) {
  for (const double impulse_Nms : {-0.02, 0.0}) {
    Host host = with_load(0.01);
    host.ask("141#8000000000000000");
    host.wait(10ms);
    inject(host, "kick", {impulse_Nms});
    const bool has_effect = impulse_Nms != 0;
    EXPECT_EQ(evidence(host).state, FaultEvidence::State::kOver);
    EXPECT_EQ(evidence(host).effects, has_effect ? 1U : 0U);
    EXPECT_EQ(evidence(host).first_effect_at,
              has_effect ? std::optional(SimTime{10ms}) : std::nullopt);
    const double expected = impulse_Nms / (0.01 + kRotorInertia_kgm2);
    for (const SimTime later : {SimTime{1ms}, SimTime{100ms}}) {
      host.wait(later);
      EXPECT_NEAR(omega(host), expected, 0.01 * std::abs(expected));  // once
    }
  }
}

TEST(MechanicsFaults, EndStopLimitsTheOutput) {
  Host host = with_load(0.001);
  host.wait(10ms);
  const double start = host.bus.truth(1).theta_out;
  inject(host, "end_stop", {-1e6, 10}, {.duration = 2s});
  host.wait(100ms);
  EXPECT_FALSE(evidence(host).first_effect_at);  // nothing is near the stop
  host.get<protocol::State2>(protocol::Torque{0.8});
  host.wait(1s);
  EXPECT_NEAR((host.bus.truth(1).theta_out - start) / std::numbers::pi * 180, 10, 0.5);
  EXPECT_NEAR(dps(host), 0, 1);
  EXPECT_GT(evidence(host).first_effect_at, 110ms);
  host.wait(1s);
  EXPECT_GT((host.bus.truth(1).theta_out - start) / std::numbers::pi * 180, 20);

  Host other = with_load(0.001);
  inject(other, "end_stop", {-5, 1e6});
  other.bus.apply({1, TurnShaft{-90}});
  other.wait(10ms);
  EXPECT_NEAR(static_cast<double>(other.multi_turn_cdeg()), 4000, 50);
}

/// 0.1^400 is 0 and 1000^400 infinite: inertia, friction and clock must stay finite and positive.
TEST(MechanicsFaults, ManyOfAKindActLikeTheStrongest) {
  const std::pair<const char*, double> strongest[] = {{"inertia", 0.1},
                                                      {"inertia", 1000},
                                                      {"friction", 1000},
                                                      {"current_gain", 10},
                                                      {"clock_drift", -20}};
  for (const auto& [kind, value] : strongest) {
    Host one = with_load(0.001);
    Host many = with_load(0.001);
    inject(one, kind, {value});
    for (int n = 0; n < 400; ++n) inject(many, kind, {value});
    for (Host* host : {&one, &many}) {
      speed(*host, 180);
      host->wait(50ms);
    }
    EXPECT_TRUE(std::isfinite(omega(many))) << kind;
    EXPECT_EQ(omega(one), omega(many)) << kind;
  }
}

ServoConfig braked_drive() {
  ServoConfig config = test::servo_config(1);
  config.profile.drive.brake = {.tau = 1, .engage_time = 0.02, .release_time = 0.03};
  config.profile.drive.load.tau = 0.05;
  config.quirks.dialect.brake_command = true;
  return config;
}

TEST(MechanicsFaults, LateBrakeFollowsItsCoilAfterTheDelay) {
  Host healthy(braked_drive());
  Host host(braked_drive());
  inject(host, "brake_late", {100});
  for (Host* one : {&healthy, &host}) {
    one->wait(50ms);
    EXPECT_EQ(evidence(host).effects, 0U);                   // the coil was not switched
    EXPECT_EQ(one->ask("141#8C01000000000000").data[1], 1);  // at once
  }
  healthy.wait(50ms);
  EXPECT_NE(healthy.bus.truth(1).omega_m, 0);
  host.wait(99ms);
  EXPECT_EQ(host.bus.truth(1).omega_m, 0);
  expect_shown(evidence(host), 50ms, 90);
  host.wait(50ms);
  EXPECT_NE(host.bus.truth(1).omega_m, 0);
  const auto effects = evidence(host).effects;
  host.wait(50ms);
  EXPECT_EQ(evidence(host).effects, effects);  // the brake has followed the coil
}

/// Torque is proportional to the cosine of the electrical angle between current and rotor.
TEST(MechanicsFaults, LostCalibrationScalesTheTorqueByItsCosine) {
  const auto speed_after = [](double offset_deg) {
    Host host(test::servo_config(1));
    if (offset_deg != 0) inject(host, "calibration_lost", {offset_deg});
    host.ask("141#A10000000A000000");  // 0.16 A: stays slow
    host.wait(2ms);
    if (offset_deg != 0) {
      EXPECT_GT(evidence(host).effects, 0U);
    }
    EXPECT_GT(host.bus.telemetry(1).i_q, 0.05);  // the drive measures the current
    return host.bus.truth(1).omega_m;
  };
  const double right = speed_after(0);
  EXPECT_GT(right, 0);
  EXPECT_NEAR(speed_after(90) / right, 0, 0.05);
  EXPECT_NEAR(speed_after(180) / right, -1, 0.05);
  EXPECT_NEAR(speed_after(60) / right, 0.5, 0.05);
}

// --- supply

TEST(PowerFaults, RebootLoopRestartsTheDrivePeriodically) {
  Host host(test::powered_drive());
  inject(host, "reboot_loop", {600, 200}, {.duration = 4s});
  std::vector<int> boots_ms;
  bool alive = true;
  for (int ms = 0; ms < 5000; ++ms) {
    host.wait(1ms);
    const bool now = host.bus.telemetry(1).alive;
    if (now && !alive) boots_ms.push_back(ms);
    alive = now;
  }
  // On at 600 ms and every 800 ms; the link charges at once, and booting takes 50 ms.
  ASSERT_EQ(boots_ms.size(), 5U);
  for (int n = 0; n < 5; ++n) EXPECT_NEAR(boots_ms[static_cast<std::size_t>(n)], 650 + 800 * n, 2);
  EXPECT_TRUE(answers(host));
  EXPECT_NEAR(host.bus.truth(1).v_bus, 24.0, 0.05);
  expect_shown(evidence(host), 0ms, 2900);
  EXPECT_LE(evidence(host).effects, 3100U);  // of 4000; not while the supply is on
}

// --- sensors

/// At 45 degrees, count 2048, with the bridge off, so that measurements move nothing.
Host undriven() {
  Host host(test::servo_config(1));
  host.ask("141#8000000000000000");
  return host;
}

constexpr double kLsb_A = 1.0 / 64;  // of 0x9D

/// The loop of a driven motor would hide it.
TEST(SensorFaults, CurrentOffsetIsShownWhileOff) {
  for (const auto& [channel, i_b_A] : {std::pair{kA, 0.0}, std::pair{kBoth, 2.0}}) {
    Host host = undriven();
    inject(host, "current_offset", {2, channel}, {.duration = 10ms});
    host.wait(5ms);
    const protocol::State3 shown = host.get<protocol::State3>(protocol::ReadState3{});
    EXPECT_NEAR(shown.i_a_A, 2, 2 * kLsb_A);
    EXPECT_NEAR(shown.i_b_A, i_b_A, 2 * kLsb_A);
    EXPECT_NEAR(shown.i_c_A, -2 - i_b_A, 4 * kLsb_A);
    host.wait(10ms);
    EXPECT_NEAR(host.get<protocol::State3>(protocol::ReadState3{}).i_a_A, 0, 2 * kLsb_A);
    expect_shown(evidence(host), 0ms, 9);
  }
}

TEST(SensorFaults, EncoderDriftTurnsTheReading) {
  Host host = undriven();
  inject(host, "encoder_drift", {36}, {.duration = 1500ms});
  const double theta_m = host.bus.truth(1).theta_m;
  host.wait(1s);
  EXPECT_NEAR(host.state_2().encoder_counts, 2048 + 36 * 16384.0 / 360,
              3.0);  // advances once a millisecond
  EXPECT_EQ(host.bus.truth(1).theta_m, theta_m);
  EXPECT_NEAR(host.state_2().speed_dps, 36.0, 10.0);
  host.wait(1s);
  EXPECT_NEAR(host.state_2().encoder_counts, 2048, 1.0);
  expect_shown(evidence(host), 0ms, 1000);
}

TEST(SensorFaults, StuckCurrentTripsTheProtection) {
  ServoConfig config = test::servo_config(1);
  config.quirks.dialect.all_error_bits = true;
  config.rom.protections[static_cast<std::size_t>(Error::kOverCurrent)] = {true, 20, 1, 0.001};
  Host host(config);
  inject(host, "current_stuck", {25, kA}, {.duration = 20ms});
  host.wait(10ms);
  EXPECT_EQ(host.get<protocol::State1>(protocol::ReadState1{}).errors,
            model::bit(Error::kOverCurrent));
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
}

}  // namespace plant_faults_test
}  // namespace lk::emulator
