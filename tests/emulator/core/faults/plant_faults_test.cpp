// Every fault of mechanics, supply and power stage, by readings of a host and true values.

#include <gtest/gtest.h>

#include <cmath>

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

constexpr double kLoad_kgm2 = 0.01;
constexpr double kInertia_kgm2 = kLoad_kgm2 + kRotorInertia_kgm2;

Host with_load(double J_kgm2 = kLoad_kgm2) {
  ServoConfig config = test::servo_config(1);
  config.profile.drive.load.J = J_kgm2;
  return Host(config);
}

void torque(Host& host, double iq_A) { host.get<protocol::State2>(protocol::Torque{iq_A}); }
void speed(Host& host, double dps) { host.get<protocol::State2>(protocol::Speed{dps, 0}); }

protocol::State1 state_1(Host& host) { return host.get<protocol::State1>(protocol::ReadState1{}); }
double link_V(const Host& host) { return host.bus.truth(1).v_bus; }

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

TEST(MechanicsFaults, PartialJamActsAsDryFriction) {
  // Half of the torque at 33 A, the end of the current sensors' range.
  const double friction_Nm = 0.5 * 33 * kTorquePerAmpere_Nm;
  Host host = with_load();
  inject(host, "jam", {50});
  torque(host, 15);
  host.wait(50ms);
  EXPECT_EQ(omega(host), 0.0);
  torque(host, 20);
  host.wait(5ms);
  const double expected = (20 * kTorquePerAmpere_Nm - friction_Nm) / kInertia_kgm2;
  EXPECT_NEAR(acceleration(host, 20ms), expected, 0.05 * expected);
  EXPECT_GE(evidence(host).effects, 60U);
  clear(host);
  const double free = 20 * kTorquePerAmpere_Nm / kInertia_kgm2;
  EXPECT_NEAR(acceleration(host, 10ms), free, 0.05 * free);
}

TEST(MechanicsFaults, FrictionDeceleratesACoastingShaft) {
  ServoConfig config = test::servo_config(1);
  config.profile.drive.mechanics.tau_coulomb = 0.005;
  config.profile.drive.mechanics.tau_static = 0.005;
  config.profile.drive.load.J = 0.001;
  Host host(config);
  inject(host, "friction", {4});
  host.wait(10ms);
  EXPECT_FALSE(evidence(host).first_effect_at);  // at rest without a load torque
  clear(host);
  speed(host, 3600);
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

TEST(MechanicsFaults, InertiaReducesTheAcceleration) {
  Host host = with_load();
  torque(host, 4.8);
  host.wait(5ms);
  const double free = 4.8 * kTorquePerAmpere_Nm / kInertia_kgm2;
  EXPECT_NEAR(acceleration(host, 20ms), free, 0.02 * free);
  inject(host, "inertia", {3});
  EXPECT_NEAR(acceleration(host, 20ms), free / 3, 0.02 * free);
  expect_shown(evidence(host), 25ms, 15);
  clear(host);
  EXPECT_NEAR(acceleration(host, 20ms), free, 0.02 * free);
}

TEST(MechanicsFaults, LoadStepAcceleratesTheShaft) {
  Host host = with_load();
  host.ask("141#8000000000000000");
  inject(host, "load_step", {0.1}, {.duration = 50ms});
  const double expected = 0.1 / kInertia_kgm2;
  EXPECT_NEAR(acceleration(host, 50ms), expected, 0.01 * expected);
  expect_shown(evidence(host), 0ms, 49);
  EXPECT_NEAR(acceleration(host, 50ms), 0.0, 0.01 * expected);
}

TEST(MechanicsFaults, KickChangesTheSpeedAtOnce) {
  Host host = with_load();
  host.ask("141#8000000000000000");
  host.wait(10ms);
  inject(host, "kick", {-0.02});
  host.wait(1ms);
  const double expected = -0.02 / kInertia_kgm2;
  EXPECT_NEAR(omega(host), expected, 0.01 * std::abs(expected));
  EXPECT_EQ(evidence(host).state, FaultEvidence::State::kOver);
  EXPECT_EQ(evidence(host).first_effect_at, 10ms);
  EXPECT_EQ(evidence(host).effects, 1U);
  host.wait(100ms);
  EXPECT_NEAR(omega(host), expected, 0.01 * std::abs(expected));  // once
}

TEST(MechanicsFaults, KickWithoutMomentumHasNoEffect) {
  Host host = with_load();
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

TEST(MechanicsFaults, BacklashMultipliesThePlay) {
  Host host(geared());
  const double elastic = 2 * 0.1 / 500;
  EXPECT_NEAR(play(host), 0.02, 2 * elastic);
  inject(host, "backlash", {3});
  EXPECT_NEAR(play(host), 0.06, 2 * elastic);
  EXPECT_TRUE(evidence(host).first_effect_at);
  clear(host);
  EXPECT_NEAR(play(host), 0.02, 2 * elastic);
}

TEST(MechanicsFaults, BrokenCouplingLeavesTheOutputBehind) {
  for (const bool elastic : {false, true}) {
    ServoConfig config = elastic ? geared() : test::servo_config(1);
    config.profile.drive.load.J = 0.001;
    const double ratio = config.profile.drive.mechanics.gear_ratio;
    Host host(config);
    const double output = host.bus.truth(1).theta_out;
    inject(host, "coupling_broken");
    host.wait(10ms);
    speed(host, 720);
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

TEST(MechanicsFaults, EndStopLimitsTheOutput) {
  Host host = with_load(0.001);
  host.wait(10ms);
  const double start = host.bus.truth(1).theta_out;
  inject(host, "end_stop", {-1e6, 10}, {.duration = 2s});
  host.wait(100ms);
  EXPECT_FALSE(evidence(host).first_effect_at);  // nothing is near the stop
  torque(host, 0.8);
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

TEST(PowerFaults, SagSetsTheErrorBit) {
  ServoConfig config = test::powered_drive();
  config.rom.protections[0] = {true, 18.0, 1.0, 0.002};
  Host host(config);
  inject(host, "sag", {10}, {.duration = 1s});
  host.wait(900ms);
  EXPECT_NEAR(link_V(host), 10.0, 0.05);
  EXPECT_NEAR(state_1(host).voltage_V, 10.0, 0.1);
  EXPECT_EQ(state_1(host).errors, model::bit(Error::kUnderVoltage));
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
  expect_shown(evidence(host), 0ms, 800);
  host.bus.apply({1, SupplyVoltage{20}});  // the fault also limits a higher supply
  host.wait(50ms);
  EXPECT_NEAR(link_V(host), 10.0, 0.05);
  host.wait(100ms);
  EXPECT_NEAR(link_V(host), 20.0, 0.05);
  EXPECT_EQ(host.get<protocol::State1>(protocol::ClearErrors{}).errors, 0U);
}

TEST(PowerFaults, SagToThePresentVoltageHasNoEffect) {
  Host host(test::powered_drive());
  inject(host, "sag", {24}, {.duration = 100ms});
  host.wait(200ms);
  EXPECT_FALSE(evidence(host).first_effect_at);
}

TEST(PowerFaults, DipResetsTheControllerAndItsTurnCount) {
  Host host(test::powered_drive());
  host.bus.apply({1, TurnShaft{3 * 360}});
  host.wait(1ms);
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 4500.0 + 3 * 36000, 3.0);
  inject(host, "dip", {1}, {.duration = 600ms});
  host.wait(590ms);
  EXPECT_NEAR(link_V(host), 4.0, 0.2);  // a volt below the reset threshold
  EXPECT_FALSE(answers(host));
  host.wait(70ms);  // boots in 50 ms
  EXPECT_TRUE(answers(host));
  EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 4500.0, 3.0);
  EXPECT_NEAR(link_V(host), 24.0, 0.05);
  expect_shown(evidence(host), 1ms, 500);
}

TEST(PowerFaults, CutEmptiesTheLink) {
  Host host(test::powered_drive());
  inject(host, "cut", {}, {.duration = 1s});
  host.wait(400ms);
  EXPECT_TRUE(answers(host));  // C·24 V/0.04 A·ln(24/5) = 442 ms
  host.bus.apply({1, PowerOn{}});
  host.wait(80ms);
  EXPECT_FALSE(answers(host));
  EXPECT_LT(link_V(host), 5.0);
  host.wait(565ms);
  EXPECT_FALSE(answers(host));
  host.wait(10ms);
  EXPECT_TRUE(answers(host));
  expect_shown(evidence(host), 0ms, 900);
}

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
  EXPECT_NEAR(link_V(host), 24.0, 0.05);
  expect_shown(evidence(host), 0ms, 2900);
  EXPECT_LE(evidence(host).effects, 3100U);  // of 4000; not while the supply is on
}

TEST(PowerFaults, BrakingRaisesTheLinkWithoutRegeneration) {
  for (const bool faulty : {false, true}) {
    ServoConfig config = test::powered_drive();
    config.profile.drive.load.J = 0.002;
    Host host(config);
    if (faulty) inject(host, "no_regeneration", {}, {.duration = 2s});
    speed(host, 1500);
    host.wait(1s);
    speed(host, 0);
    double most_V = 0;
    for (int n = 0; n < 100; ++n) {
      host.wait(1ms);
      most_V = std::max(most_V, link_V(host));
    }
    if (!faulty) {
      EXPECT_LT(most_V, 25.0);
      continue;
    }
    // ½·J·ω² = 0.72 J into 470 µF at 24 V would give 60 V; copper loss takes a share.
    EXPECT_GT(most_V, 28.0);
    EXPECT_TRUE(evidence(host).first_effect_at);
    EXPECT_EQ(evidence(host).first_on, "drive 1");
  }
}

// --- power stage

enum Phase { kA, kB, kC };
enum Side { kHigh, kLow };

/// Returns a drive with a high inertia that hardly moves. At this angle the current of phase a is
/// that of the q axis: at 45 rotor degrees, 630 electrical degrees, i_a = −i_q·sin 270° = i_q.
Host heavy() { return with_load(1); }

protocol::State3 currents_at(Host& host, double iq_A) {
  torque(host, iq_A);
  host.wait(20ms);
  return host.get<protocol::State3>(protocol::ReadState3{});
}

TEST(PowerStageFaults, OpenPhaseCarriesNoCurrent) {
  Host host = heavy();
  EXPECT_NEAR(currents_at(host, 3.2).i_a_A, 3.2, 0.1);
  inject(host, "phase_open", {kA}, {.duration = 50ms});
  const auto broken = currents_at(host, 3.2);
  EXPECT_NEAR(broken.i_a_A, 0.0, 1.0 / 64);
  EXPECT_NEAR(broken.i_b_A, -broken.i_c_A, 0.02);
  expect_shown(evidence(host), 20ms, 10);
  host.wait(50ms);
  EXPECT_NEAR(currents_at(host, 3.2).i_a_A, 3.2, 0.1);
}

TEST(PowerStageFaults, OpenSwitchCarriesOneDirectionOnly) {
  Host host = heavy();
  inject(host, "switch_open", {kA, kHigh});
  EXPECT_NEAR(currents_at(host, -3.2).i_a_A, -3.2, 0.1);  // through the lower switch and the diodes
  EXPECT_LT(currents_at(host, 3.2).i_a_A, 0.5);
  EXPECT_GE(evidence(host).effects, 10U);
  clear(host);
  EXPECT_NEAR(currents_at(host, 3.2).i_a_A, 3.2, 0.1);
  inject(host, "switch_open", {kA, kLow});
  EXPECT_GT(currents_at(host, -3.2).i_a_A, -0.5);
}

TEST(PowerStageFaults, ShortedSwitchTripsUnderVoltage) {
  ServoConfig config = test::servo_config(1);
  config.quirks.dialect.all_error_bits = true;
  config.rom.protections[0] = {true, 18.0, 1.0, 0.002};
  Host host(config);
  inject(host, "switch_shorted", {kB, kHigh}, {.duration = 5ms});
  host.wait(5ms);
  // The bridge idles at half the voltage: half of the time the source drives two switches of 10 mΩ
  // through its own 50 mΩ. The firmware detects the under-voltage and switches off.
  EXPECT_EQ(state_1(host).errors & model::bit(Error::kUnderVoltage),
            model::bit(Error::kUnderVoltage));
  EXPECT_FALSE(host.bus.telemetry(1).bridge_on);
  expect_shown(evidence(host), 0ms, 1);
  host.wait(50ms);
  EXPECT_NEAR(state_1(host).voltage_V, 24.0, 0.1);
}

TEST(PowerStageFaults, DeadBridgeDrivesNothingWithoutAnError) {
  Host host = heavy();
  inject(host, "bridge_dead", {}, {.duration = 100ms});
  torque(host, 3.2);
  host.wait(50ms);
  EXPECT_NEAR(host.bus.truth(1).i_q, 0.0, 1e-6);
  EXPECT_EQ(host.bus.truth(1).omega_m, 0.0);
  EXPECT_TRUE(host.bus.telemetry(1).bridge_on);
  EXPECT_EQ(state_1(host).errors, 0U);
  expect_shown(evidence(host), 0ms, 40);
  host.wait(100ms);
  EXPECT_NEAR(host.bus.truth(1).i_q, 3.2, 0.1);
  EXPECT_GT(host.bus.truth(1).omega_m, 0.0);
}

}  // namespace plant_faults_test
}  // namespace lk::emulator
