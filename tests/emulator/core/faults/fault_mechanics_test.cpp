// Every mechanical fault, by its effect on the shaft.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/emulator/core/faults/fault_support.hpp"

namespace lk::emulator {
namespace fault_mechanics_test {

using namespace std::chrono_literals;
using test::clear;
using test::evidence;
using test::expect_shown;
using test::Host;
using test::inject;

// For the test drive: k_t = 3/2·p·ψ_f.
constexpr double kTorquePerAmpere_Nm = 1.5 * 14 * 0.00499;
constexpr double kRotorInertia_kgm2 = 933e-7;

double omega(const Host& host) { return host.bus.truth(1).omega_out; }
double dps(const Host& host) { return omega(host) / std::numbers::pi * 180; }

/// Returns the mean acceleration in rad/s² over the next `time`.
double acceleration(Host& host, SimTime time) {
  const double before = omega(host);
  host.wait(time);
  return (omega(host) - before) / std::chrono::duration<double>(time).count();
}

Host with_load(double J_kgm2) {
  ServoConfig config = test::servo_config(1);
  config.profile.drive.load.J = J_kgm2;
  return Host(config);
}

TEST(MechanicsFaults, AJamHoldsTheShaftAndTheStallProtectionNotices) {
  for (const bool watched : {false, true}) {
    ServoConfig config = test::servo_config(1);
    config.quirks.dialect.all_error_bits = true;
    config.rom.protections[static_cast<std::size_t>(model::Error::kStall)] = {watched, 0.3, 0, 0};
    config.rom.max_torque_current_lsb = 100;
    Host host(config);
    host.get<protocol::State2>(protocol::Speed{180, 0});
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

TEST(MechanicsFaults, APartialJamIsDryFriction) {
  // Half of the torque at 33 A, the end of the current sensors' range.
  const double friction_Nm = 0.5 * 33 * kTorquePerAmpere_Nm;
  Host host = with_load(0.01);
  inject(host, "jam", {50});
  host.get<protocol::State2>(protocol::Torque{15});
  host.wait(50ms);
  EXPECT_EQ(omega(host), 0.0);
  host.get<protocol::State2>(protocol::Torque{20});
  host.wait(5ms);
  const double expected = (20 * kTorquePerAmpere_Nm - friction_Nm) / (0.01 + kRotorInertia_kgm2);
  EXPECT_NEAR(acceleration(host, 20ms), expected, 0.05 * expected);
  EXPECT_GE(evidence(host).effects, 60U);
  clear(host);
  const double free = 20 * kTorquePerAmpere_Nm / (0.01 + kRotorInertia_kgm2);
  EXPECT_NEAR(acceleration(host, 10ms), free, 0.05 * free);
}

TEST(MechanicsFaults, MoreFrictionBrakesACoastingShaftSooner) {
  ServoConfig config = test::servo_config(1);
  config.profile.drive.mechanics.tau_coulomb = 0.005;
  config.profile.drive.mechanics.tau_static = 0.005;
  config.profile.drive.load.J = 0.001;
  Host host(config);
  inject(host, "friction", {4});
  host.wait(10ms);
  EXPECT_FALSE(evidence(host).first_effect_at);  // at rest without a load torque
  clear(host);
  host.get<protocol::State2>(protocol::Speed{3600, 0});
  host.wait(1s);
  host.ask("141#8000000000000000");
  host.wait(5ms);
  const double inertia = 0.001 + kRotorInertia_kgm2;
  EXPECT_NEAR(acceleration(host, 100ms), -0.005 / inertia, 0.02 * 0.005 / inertia);
  inject(host, "friction", {4});
  EXPECT_NEAR(acceleration(host, 100ms), -0.02 / inertia, 0.02 * 0.02 / inertia);
  expect_shown(evidence(host, 1), 1115ms, 95);
  clear(host);
  EXPECT_NEAR(acceleration(host, 100ms), -0.005 / inertia, 0.02 * 0.005 / inertia);
}

TEST(MechanicsFaults, MoreInertiaIsHarderToAccelerate) {
  Host host = with_load(0.01);
  host.get<protocol::State2>(protocol::Torque{4.8});
  host.wait(5ms);
  const double free = 4.8 * kTorquePerAmpere_Nm / (0.01 + kRotorInertia_kgm2);
  EXPECT_NEAR(acceleration(host, 20ms), free, 0.02 * free);
  inject(host, "inertia", {3});
  EXPECT_NEAR(acceleration(host, 20ms), free / 3, 0.02 * free);
  expect_shown(evidence(host), 25ms, 15);
  clear(host);
  EXPECT_NEAR(acceleration(host, 20ms), free, 0.02 * free);
}

TEST(MechanicsFaults, ALoadStepPushesTheShaft) {
  Host host = with_load(0.01);
  host.ask("141#8000000000000000");
  inject(host, "load_step", {0.1}, {.duration = 50ms});
  const double expected = 0.1 / (0.01 + kRotorInertia_kgm2);
  EXPECT_NEAR(acceleration(host, 50ms), expected, 0.01 * expected);
  expect_shown(evidence(host), 0ms, 49);
  EXPECT_NEAR(acceleration(host, 50ms), 0.0, 0.01 * expected);
}

TEST(MechanicsFaults, AKickIsMomentumAtOnce) {
  Host host = with_load(0.01);
  host.ask("141#8000000000000000");
  host.wait(10ms);
  inject(host, "kick", {-0.02});
  host.wait(1ms);
  const double expected = -0.02 / (0.01 + kRotorInertia_kgm2);
  EXPECT_NEAR(omega(host), expected, 0.01 * std::abs(expected));
  EXPECT_EQ(evidence(host).state, FaultEvidence::State::kOver);
  EXPECT_EQ(evidence(host).first_effect_at, 10ms);
  EXPECT_EQ(evidence(host).effects, 1U);
  host.wait(100ms);
  EXPECT_NEAR(omega(host), expected, 0.01 * std::abs(expected));  // once
}

TEST(MechanicsFaults, AKickWithoutMomentumIsNone) {
  Host host = with_load(0.01);
  host.wait(10ms);
  inject(host, "kick", {0});
  EXPECT_EQ(evidence(host).state, FaultEvidence::State::kOver);
  EXPECT_EQ(evidence(host).effects, 0U);
  EXPECT_FALSE(evidence(host).first_effect_at);
}

/// A gear of 10 with a play of 0.02 rad, and some friction at the output.
ServoConfig geared() {
  ServoConfig config = test::servo_config(1);
  model::MechanicsParams& mechanics = config.profile.drive.mechanics;
  mechanics.gear_ratio = 10;
  mechanics.backlash_out = 0.02;
  mechanics.gear_stiffness_out = 500;
  mechanics.gear_damping_out = 0.5;
  mechanics.J_out = 1e-3;
  mechanics.tau_coulomb_out = 0.01;
  return config;
}

/// Returns the output's play in rad, with the rotor held and a push to either side.
double play(Host& host) {
  host.get<protocol::State2>(protocol::Position2{0, 4500});
  std::array<double, 2> rests{};
  for (const double side : {-1.0, 1.0}) {
    model::LoadParams load;
    load.tau = 0.1 * side;
    host.bus.apply({1, Load{load}});
    host.wait(2s);
    rests[side > 0 ? 1 : 0] = host.bus.truth(1).theta_out - host.bus.truth(1).theta_m / 10;
  }
  return rests[1] - rests[0];
}

TEST(MechanicsFaults, MorePlayLetsTheOutputGoFurther) {
  Host host(geared());
  const double elastic = 2 * 0.1 / 500;
  EXPECT_NEAR(play(host), 0.02, 2 * elastic);
  inject(host, "backlash", {3});
  EXPECT_NEAR(play(host), 0.06, 2 * elastic);
  EXPECT_TRUE(evidence(host).first_effect_at);
  EXPECT_EQ(evidence(host).first_on, "drive 1");
  clear(host);
  EXPECT_NEAR(play(host), 0.02, 2 * elastic);
}

TEST(MechanicsFaults, WithABrokenCouplingTheRotorTurnsAlone) {
  for (const bool elastic : {false, true}) {
    ServoConfig config = elastic ? geared() : test::servo_config(1);
    config.profile.drive.load.J = 0.001;
    const double ratio = config.profile.drive.mechanics.gear_ratio;
    Host host(config);
    const double output = host.bus.truth(1).theta_out;
    inject(host, "coupling_broken");
    host.wait(10ms);
    host.get<protocol::State2>(protocol::Speed{720, 0});
    host.wait(500ms);
    EXPECT_NEAR(host.state_2().speed_dps, 720, 20);
    EXPECT_NEAR(host.bus.truth(1).theta_out, output, 1e-6);
    EXPECT_GT(host.bus.truth(1).theta_m / ratio - output, 0.3);
    EXPECT_GT(evidence(host).first_effect_at, 10ms);  // no push until then
    EXPECT_LT(evidence(host).first_effect_at, 50ms);  // the play has been taken up
    clear(host);
    host.wait(500ms);
    EXPECT_NEAR(host.bus.truth(1).theta_out, host.bus.truth(1).theta_m / ratio, 0.02);
    EXPECT_NEAR(dps(host), 720 / ratio, 20);
  }
}

TEST(MechanicsFaults, AnEndStopIsWhereItIsPut) {
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
TEST(MechanicsFaults, HundredsOfAKindAreNoMoreThanTheStrongest) {
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
      host->get<protocol::State2>(protocol::Speed{180, 0});
      host->wait(50ms);
    }
    EXPECT_TRUE(std::isfinite(omega(many))) << kind;
    EXPECT_EQ(omega(one), omega(many)) << kind;
  }
}

}  // namespace fault_mechanics_test
}  // namespace lk::emulator
