// Every fault of supply and power stage, by readings of a host and true values.

#include <gtest/gtest.h>

#include "tests/emulator/core/faults/fault_support.hpp"

namespace lk::emulator {
namespace fault_power_test {

using namespace std::chrono_literals;
using model::Error;
using test::answers;
using test::clear;
using test::evidence;
using test::expect_shown;
using test::Host;
using test::inject;

protocol::State1 state_1(Host& host) { return host.get<protocol::State1>(protocol::ReadState1{}); }
double link_V(const Host& host) { return host.bus.truth(1).v_bus; }

// --- supply

TEST(PowerFaults, ASagSetsTheErrorBit) {
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

TEST(PowerFaults, ASagToWhatTheSupplyHasAnywayIsNone) {
  Host host(test::powered_drive());
  inject(host, "sag", {24}, {.duration = 100ms});
  host.wait(200ms);
  EXPECT_FALSE(evidence(host).first_effect_at);
}

TEST(PowerFaults, ADipResetsTheControllerAndTheTurnsAreLost) {
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

TEST(PowerFaults, ACutEmptiesTheLinkWhateverIsConnected) {
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

TEST(PowerFaults, ARebootLoopBootsAgainAndAgain) {
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

TEST(PowerFaults, ARectifierLetsBrakingRaiseTheLink) {
  for (const bool faulty : {false, true}) {
    ServoConfig config = test::powered_drive();
    config.profile.drive.load.J = 0.002;
    Host host(config);
    if (faulty) inject(host, "no_regeneration", {}, {.duration = 2s});
    host.get<protocol::State2>(protocol::Speed{1500, 0});
    host.wait(1s);
    host.get<protocol::State2>(protocol::Speed{0, 0});
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

/// A high inertia that hardly moves. At this angle the current of phase a is that of the q axis: at
/// 45 rotor degrees, 630 electrical degrees, i_a = −i_q·sin 270° = i_q.
Host heavy() {
  ServoConfig config = test::servo_config(1);
  config.profile.drive.load.J = 1;
  return Host(config);
}

protocol::State3 pulled(Host& host, double iq_A) {
  host.get<protocol::State2>(protocol::Torque{iq_A});
  host.wait(20ms);
  return host.get<protocol::State3>(protocol::ReadState3{});
}

TEST(PowerStageFaults, AnOpenPhaseCarriesNoCurrent) {
  Host host = heavy();
  EXPECT_NEAR(pulled(host, 3.2).i_a_A, 3.2, 0.1);
  inject(host, "phase_open", {kA}, {.duration = 50ms});
  const auto broken = pulled(host, 3.2);
  EXPECT_NEAR(broken.i_a_A, 0.0, 1.0 / 64);
  EXPECT_NEAR(broken.i_b_A, -broken.i_c_A, 0.02);
  expect_shown(evidence(host), 20ms, 10);
  host.wait(50ms);
  EXPECT_NEAR(pulled(host, 3.2).i_a_A, 3.2, 0.1);
}

TEST(PowerStageFaults, ASwitchThatStaysOpenCarriesOneDirectionOnly) {
  Host host = heavy();
  inject(host, "switch_open", {kA, kHigh});
  EXPECT_NEAR(pulled(host, -3.2).i_a_A, -3.2, 0.1);  // through the lower switch and the diodes
  EXPECT_LT(pulled(host, 3.2).i_a_A, 0.5);
  EXPECT_GE(evidence(host).effects, 10U);
  clear(host);
  EXPECT_NEAR(pulled(host, 3.2).i_a_A, 3.2, 0.1);
  inject(host, "switch_open", {kA, kLow});
  EXPECT_GT(pulled(host, -3.2).i_a_A, -0.5);
}

TEST(PowerStageFaults, AShortedSwitchShortsTheLinkWithItsPartner) {
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

TEST(PowerStageFaults, ADeadBridgeDrivesNothingAndReportsNothing) {
  Host host = heavy();
  inject(host, "bridge_dead", {}, {.duration = 100ms});
  host.get<protocol::State2>(protocol::Torque{3.2});
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

}  // namespace fault_power_test
}  // namespace lk::emulator
