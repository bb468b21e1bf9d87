// Motion of a real motor as a host sees it, with the delivered profile mf7015 including noise,
// friction and cogging. Expected values come from the profile's numbers, not from the code.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/profile.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace motion_test {

using namespace std::chrono_literals;
using test::Host;

constexpr double kDegPerRad = 180 / std::numbers::pi;

ServoConfig motor(const std::string& name = "mf7015") {
  ServoConfig config;
  config.id = 1;
  config.profile = test::profile(name);
  config.rom = config.profile.factory;
  config.boot_angle_deg = 45;
  return config;
}

void set_load_torque(Host& host, double tau_Nm) {
  model::LoadParams load;
  load.tau = tau_Nm;
  host.bus.set_load(1, load);
}

double angle_deg(Host& host) { return static_cast<double>(host.multi_turn_cdeg()) / 100; }

void command(Host& host, const protocol::Command& content) {
  host.ask(protocol::encode_query(1, content, protocol::kLegacyFormat));
}

double speed_dps(const Host& host) { return host.bus.truth(1).omega_m * kDegPerRad; }

/// Returns the mean speed over `duration`, from the distance travelled.
double mean_speed_dps(Host& host, SimTime duration) {
  const double start = host.bus.truth(1).theta_m;
  host.wait(duration);
  return (host.bus.truth(1).theta_m - start) * kDegPerRad /
         std::chrono::duration<double>(duration).count();
}

/// A motor at 720 °/s.
Host turning() {
  Host host(motor());
  command(host, protocol::Speed{720});
  host.wait(1s);
  return host;
}

double k_t(const model::DriveParams& drive) {
  return 1.5 * drive.motor.pole_pairs * drive.motor.psi_f;
}

// --- torque

// dω/dt = (k_t·iq − τ_coulomb − B·ω)/J. Cogging averages out over a turn; the magnets are at 25 °C.
TEST(Torque, SpeedRisesWithTorqueOverInertia) {
  const auto config = motor();
  const auto& drive = config.profile.drive;
  for (const double iq_A : {3.2, -3.2, 1.6}) {
    Host host(config);
    command(host, protocol::Torque{iq_A});
    host.wait(20ms);
    const double omega_0 = host.bus.truth(1).omega_m;
    host.wait(30ms);
    const double omega_1 = host.bus.truth(1).omega_m;
    const double drag =
        drive.mechanics.tau_coulomb + drive.mechanics.B * std::abs(omega_0 + omega_1) / 2;
    const double tau = k_t(drive) * std::abs(iq_A) - drag;
    const double expected = std::copysign(tau / drive.mechanics.J, iq_A) * 0.030;
    EXPECT_NEAR(omega_1 - omega_0, expected, 0.03 * std::abs(expected)) << iq_A;
  }
}

TEST(Torque, AcceleratesUntilTheSupplyLimitsTheSpeed) {
  const auto config = motor();
  Host host(config);
  command(host, protocol::Torque{3.2});
  host.wait(2s);
  const double first = speed_dps(host);
  host.wait(500ms);
  EXPECT_NEAR(speed_dps(host), first, 0.02 * first);
  // The back-EMF approaches the voltage: ω_max ≤ (V/√3)/(p·ψ_f), reduced by duty limit, drag and
  // resistance.
  const auto& drive = config.profile.drive;
  const double no_load_dps = drive.supply.v_source / std::numbers::sqrt3 /
                             (drive.motor.pole_pairs * drive.motor.psi_f) * kDegPerRad;
  EXPECT_LT(first, 1.02 * no_load_dps);
  EXPECT_GT(first, 0.85 * no_load_dps);
}

TEST(Torque, NoLoadSpeedFollowsTheSupply) {
  const auto top_dps = [](double supply_V) {
    Host host(motor());
    host.bus.set_supply_voltage(1, supply_V);
    command(host, protocol::Torque{3.2});
    host.wait(2s);
    return speed_dps(host);
  };
  EXPECT_NEAR(top_dps(12) / top_dps(24), 0.5, 0.05);
}

TEST(Torque, ReplyShowsTheActualCurrent) {
  Host host(motor());
  command(host, protocol::Torque{-3.2});
  host.wait(20ms);
  double sum_A = 0;
  for (int k = 0; k < 20; ++k) {
    sum_A += host.state_2().iq_A;
    host.wait(1ms);
  }
  EXPECT_NEAR(sum_A / 20, -3.2, 0.1);
  EXPECT_LT(host.state_2().speed_dps, 0);
}

// --- speed

TEST(Speed, ReachedWithoutSteadyError) {
  for (const double wanted_dps : {720.0, -720.0, 90.0, 3600.0}) {
    Host host(motor());
    command(host, protocol::Speed{wanted_dps});
    host.wait(2s);
    EXPECT_NEAR(mean_speed_dps(host, 1s), wanted_dps, 0.002 * std::abs(wanted_dps) + 0.5);
    // A single reading, between two cogs.
    EXPECT_NEAR(host.state_2().speed_dps, wanted_dps, 0.03 * std::abs(wanted_dps) + 60);
  }
}

TEST(Speed, HeldHoldsAgainstALoad) {
  Host host = turning();
  set_load_torque(host, -0.2);  // about 2 A
  host.wait(1s);
  EXPECT_NEAR(mean_speed_dps(host, 1s), 720, 2);
  EXPECT_GT(host.state_2().iq_A, 1);
}

// --- position

struct Arrival {
  const char* name;
  protocol::Command command;
  double target_deg;  // multi-turn, from 45°
};

class Position : public ::testing::TestWithParam<Arrival> {};

// Within one 14-bit count, which is 0.022°, plus half a count for a target between two; then it
// holds.
TEST_P(Position, ArrivesWithinOneCountAndHolds) {
  Host host(motor());
  command(host, GetParam().command);
  host.wait(3s);
  for (int k = 0; k < 200; ++k) {
    host.wait(5ms);
    ASSERT_NEAR(angle_deg(host), GetParam().target_deg, 1.5 * 360 / 16384 + 0.005);
    ASSERT_LT(std::abs(host.bus.truth(1).omega_m) * kDegPerRad, 10);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Commands, Position,
    ::testing::Values(Arrival{"1", protocol::Position1{36000}, 360},
                      Arrival{"1_back", protocol::Position1{-123456}, -1234.56},
                      Arrival{"2", protocol::Position2{500, 36000}, 360},
                      Arrival{"2_back", protocol::Position2{720, -9000}, -90},
                      Arrival{"3_clockwise", protocol::Position3{0, 9000}, 90},
                      Arrival{"3_counter", protocol::Position3{1, 9000}, 90 - 360},
                      Arrival{"4_clockwise", protocol::Position4{0, 360, 2000}, 380},
                      Arrival{"4_counter", protocol::Position4{1, 360, 2000}, 20},
                      Arrival{"5", protocol::Position5{1000}, 55},
                      Arrival{"5_back", protocol::Position5{-100000}, -955},
                      Arrival{"6", protocol::Position6{360, 18000}, 225},
                      Arrival{"6_back", protocol::Position6{360, -18000}, -135}),
    [](const auto& instance) { return instance.param.name; });

TEST(Hold, HoldsAgainstALoad) {
  Host host(motor());
  command(host, protocol::Position1{9000});
  host.wait(1s);
  set_load_torque(host, 0.3);
  host.wait(1s);
  EXPECT_NEAR(angle_deg(host), 90, 0.05);
  EXPECT_LT(host.state_2().iq_A, -2);  // counteracts: k_t is about 0.105 Nm/A
}

/// docs/reference/protocol.md §4.3: a repeated target at the present angle causes no turn, for
/// either direction. A turn would be degrees off after 50 ms.
TEST(Hold, SameTargetAgainCausesNoTurn) {
  for (const char* name : {"mg4005", "mg6010", "mg8016", "mf7015"}) {
    Host host(motor(name));
    for (int n = 0; n < 24; ++n) {
      const auto target_cdeg = static_cast<std::uint16_t>(12000 + 137 * n);
      command(host, protocol::Position2{0, target_cdeg});
      host.wait(300ms);
      const auto direction = n % 2 == 0 ? protocol::kClockwise : protocol::kCounterClockwise;
      command(host, protocol::Position3{direction, target_cdeg});
      host.wait(50ms);
      EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), target_cdeg, 20) << name << ' ' << n;
    }
  }
}

TEST(Hold, IncrementsAddUpWhileMoving) {
  Host host(motor());
  command(host, protocol::Position1{4500});
  host.wait(500ms);
  for (int k = 0; k < 36; ++k) {
    command(host, protocol::Position6{3600, 1000});
    host.wait(3ms);
  }
  host.wait(2s);
  EXPECT_NEAR(angle_deg(host), 45 + 360, 0.04);
}

// --- off and idle

TEST(RunStates, OffCoastsWithoutCurrent) {
  Host host(motor());
  command(host, protocol::Speed{3600});  // slow rotors stop in the next cog
  host.wait(1s);
  command(host, protocol::Off{});
  host.wait(50ms);
  EXPECT_GT(speed_dps(host), 100);  // coasting
  EXPECT_NEAR(host.bus.truth(1).i_q, 0, 0.05);
  host.wait(5s);
  EXPECT_NEAR(speed_dps(host), 0, 1);
}

TEST(RunStates, IdleShaftDoesNotMove) {
  Host host(motor());
  const double start = host.bus.truth(1).theta_m;
  host.wait(2s);
  EXPECT_NEAR((host.bus.truth(1).theta_m - start) * kDegPerRad, 0, 0.5);
}

// --- signs

// Clockwise is positive in everything: torque, speed, angles, encoder.
TEST(Signs, ClockwiseIsPositiveEverywhere) {
  for (const int sign : {1, -1}) {
    Host host(motor());
    const auto start = host.state_2();
    command(host, protocol::Torque{1.6 * sign});
    host.wait(15ms);
    const auto state = host.state_2();
    EXPECT_GT(state.iq_A * sign, 0.5);
    EXPECT_GT(state.speed_dps * sign, 50);
    EXPECT_GT((state.encoder_counts - start.encoder_counts) * sign, 5);
    EXPECT_GT((static_cast<double>(host.multi_turn_cdeg()) - 4500) * sign, 10);
    EXPECT_GT((host.single_turn_cdeg() - 4500) * sign, 10);
  }
}

// --- a geared motor

// Rotor angles on the wire; the encoder field spans one output turn: 65536 counts are 3600°.
TEST(Geared, EncoderSpansTheOutputTurn) {
  auto config = motor("mg4005");
  config.boot_angle_deg = 8.92;
  Host host(config);
  EXPECT_NEAR(host.state_2().encoder_counts, 162, 1);
  struct Reading {
    std::int32_t angle_cdeg;
    int encoder;
  };
  for (const auto& reading : {Reading{9811, 1786}, Reading{80986, 14743}, Reading{67425, 12274}}) {
    command(host, protocol::Position2{1000, reading.angle_cdeg});
    host.wait(3s);
    EXPECT_NEAR(static_cast<double>(host.multi_turn_cdeg()), reading.angle_cdeg, 3);
    EXPECT_NEAR(host.state_2().encoder_counts, reading.encoder, 1);
  }
}

}  // namespace motion_test
}  // namespace lk::emulator
