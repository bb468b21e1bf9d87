// Motion that the host of a drive did not ask for: unasked_deg, unasked_dps, unasked_J.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/emulator/core/core_support.hpp"
#include "tests/emulator/core/faults/fault_support.hpp"
#include "tests/support/test_bus.hpp"

namespace lk::emulator {
namespace unasked_test {

using namespace std::chrono_literals;
using test::Host;
using test::servo_config;

constexpr const char* kOff = "141#8000000000000000";
constexpr const char* kStop = "141#8100000000000000";
constexpr const char* kRun = "141#8800000000000000";
constexpr const char* kReadAngle = "141#9200000000000000";
constexpr const char* kReadState1 = "141#9A00000000000000";
constexpr const char* kSpeed = "141#A2000000A08C0000";  // 360 dps

protocol::Frame target(double deg) {
  return protocol::encode_query(1, protocol::Position1{static_cast<std::int32_t>(100 * deg)},
                                protocol::wire_format(servo_config(1).quirks.dialect, Series::kMg));
}

double signal(const Host& host, const char* name) {
  return find_signal(name)->read(host.bus.view(1));
}
double unasked_deg(const Host& host) { return signal(host, "unasked_deg"); }

TEST(Unasked, CountsAFirstTargetWithoutAnAngle) {
  Host host(servo_config(1));  // at 45 degrees
  test::send(host, kReadState1, 1ms);
  test::send(host, target(135), 2s);
  EXPECT_NEAR(unasked_deg(host), 90, 1);
  EXPECT_GT(signal(host, "unasked_dps"), 100);
  EXPECT_GT(signal(host, "unasked_J"), 0);
}

TEST(Unasked, WorkIsThatOfTheMotor) {
  ServoConfig config = servo_config(1);
  config.profile.drive.load.tau = -0.5;  // constant, against the motion
  Host host(config);
  const double from = host.bus.truth(1).theta_out;
  test::send(host, target(45 + 360), 3s);
  const double way = host.bus.truth(1).theta_out - from;
  // Work against the load; the motor also brakes the shaft, so the peak is a little higher.
  EXPECT_NEAR(signal(host, "unasked_J"), 0.5 * way, 0.2 * 0.5 * way);
}

TEST(Unasked, AnyAngleMakesAMotionAsked) {
  for (const char* ask : {"141#9000000000000000", kReadAngle, "141#9400000000000000",
                          "141#9C00000000000000", "141#A100000000000000"}) {
    Host host(servo_config(1));
    test::send(host, ask, 1ms);
    test::send(host, target(135), 2s);
    EXPECT_EQ(unasked_deg(host), 0) << ask;
  }
}

/// The host reads angles in the replies, but its targets show that it ignores them.
TEST(Unasked, AStreamOfOldTargetsStaysUnasked) {
  Host host(servo_config(1));
  for (int n = 0; n < 200; ++n) test::send(host, target(135 + 0.01 * n), 5ms);
  EXPECT_NEAR(unasked_deg(host), 90, 5);
}

/// The first command is for no motion, and the angle in its reply starts the stream.
TEST(Unasked, AStreamThatTakesUpTheAngleIsAsked) {
  Host host(servo_config(1));
  test::send(host, target(46), 5ms);
  for (int n = 0; n < 900; ++n) test::send(host, target(46 + 0.1 * n), 5ms);
  EXPECT_GT(host.multi_turn_cdeg(), 13000);
  EXPECT_LT(unasked_deg(host), 5);
}

TEST(Unasked, EachEventRequiresTheAngleAgain) {
  const auto turned = [](auto event) {
    ServoConfig config = servo_config(1);
    config.quirks.off_needs_run = false;
    Host host(config);
    test::send(host, kReadAngle, 1ms);
    test::send(host, target(90), 1s);
    EXPECT_EQ(unasked_deg(host), 0);
    event(host);
    test::send(host, target(150), 2s);
    return unasked_deg(host);
  };
  EXPECT_EQ(turned([](Host&) {}), 0);
  EXPECT_GT(turned([](Host& host) { test::send(host, kOff, 1ms); }), 50);
  EXPECT_GT(turned([](Host& host) { test::send(host, kStop, 1ms); }), 50);
  EXPECT_GT(turned([](Host& host) { host.bus.power_cycle(1); }), 50);
  EXPECT_GT(turned([](Host& host) { test::inject(host, "encoder_jump", {5.0}); }), 50);
  EXPECT_EQ(turned([](Host& host) {
              test::send(host, kOff, 1ms);
              test::send(host, kReadAngle, 1ms);
            }),
            0);
}

/// A stream of targets that was asked for goes on through a fault, though the shaft lags.
TEST(Unasked, AFaultDoesNotEndAStream) {
  Host host(servo_config(1));
  test::send(host, kReadAngle, 1ms);
  for (int n = 0; n < 100; ++n) {
    if (n == 50) test::inject(host, "encoder_jump", {60.0});
    test::send(host, target(45 + 0.5 * n), 10ms);
  }
  EXPECT_EQ(unasked_deg(host), 0);
}

TEST(Unasked, ALatchedErrorRequiresTheAngleAgain) {
  ServoConfig config = servo_config(1);
  config.rom.protections[static_cast<std::size_t>(model::Error::kLostInput)] = {true, 0.1, 0, 0};
  Host host(config);
  test::send(host, kReadAngle, 1ms);
  test::send(host, target(90), 50ms);
  for (int n = 0; n < 20; ++n) test::send(host, target(90), 50ms);
  host.wait(200ms);                     // the protection trips
  host.bus.apply({1, TurnShaft{-80}});  // the arm falls
  host.wait(500ms);
  EXPECT_EQ(unasked_deg(host), 0);
  test::send(host, {"141#9B00000000000000", kRun});
  for (int n = 0; n < 20; ++n) test::send(host, target(90), 50ms);
  EXPECT_NEAR(unasked_deg(host), 80, 5);
}

TEST(Unasked, ResumingAfterAStopCounts) {
  Host host(servo_config(1));  // legacy: 0x88 resumes
  test::send(host, kReadAngle, 1ms);
  test::send(host, target(90), 1s);
  test::send(host, kStop, 100ms);
  host.bus.apply({1, TurnShaft{60}});
  host.wait(100ms);
  EXPECT_EQ(unasked_deg(host), 0);
  test::send(host, kRun, 1s);
  EXPECT_NEAR(unasked_deg(host), 60, 2);
}

/// A host at 100 Hz leaves the drive turning: unasked from 50 ms after its last frame on.
TEST(Unasked, TurningOnInSilenceCounts) {
  Host host(servo_config(1));
  test::send(host, kReadAngle, 10ms);
  for (int n = 0; n < 40; ++n) test::send(host, kSpeed, 10ms);
  EXPECT_EQ(unasked_deg(host), 0);
  host.wait(38ms);
  EXPECT_EQ(unasked_deg(host), 0);
  host.wait(1002ms);
  EXPECT_NEAR(unasked_deg(host), 360, 4);
  EXPECT_NEAR(signal(host, "unasked_dps"), 360, 10);
  test::send(host, kReadAngle, 1s);  // the host knows the angle again, and lets the drive turn
  EXPECT_NEAR(unasked_deg(host), 360, 4);
}

TEST(Unasked, BurstsAndSlowHostsAreNotSilent) {
  Host host(servo_config(1));
  test::send(host, kReadAngle, 10ms);
  for (int n = 0; n < 20; ++n) {
    for (int burst = 0; burst < 10; ++burst) test::send(host, kSpeed, 100us);
    host.wait(100ms);
  }
  EXPECT_EQ(unasked_deg(host), 0);
}

TEST(Unasked, ATargetAfterSilenceRequiresTheAngle) {
  for (const bool reads : {false, true}) {
    Host host(servo_config(1));
    for (int n = 0; n < 40; ++n) test::send(host, target(45), 10ms);
    host.wait(1s);
    if (reads) test::send(host, kReadAngle, 10ms);
    test::send(host, target(100), 1s);
    EXPECT_NEAR(unasked_deg(host), reads ? 0 : 55, 2) << reads;
  }
}

/// The reply of a query before the event arrives after it, through a slow adapter.
TEST(Unasked, AnAngleFromBeforeTheEventDoesNotCount) {
  BusConfig config = test::bus_config({1}, 1'000'000);
  AdapterProfile adapter{};
  adapter.times.rx_us = 10'000;
  config.adapter = &adapter;
  Host host(config);
  host.talk(test::frame(kReadAngle), 5ms);  // executed, but not yet received
  host.bus.power_cycle(1);
  host.wait(100ms);
  host.talk(target(135), 2s);
  EXPECT_NEAR(unasked_deg(host), 90, 1);
}

TEST(Unasked, AFirstTargetOfZeroCountsAlthoughTheAngleIsKnown) {
  Host host(servo_config(1));
  test::send(host, kReadAngle, 1ms);
  test::send(host, target(0), 2s);
  EXPECT_NEAR(unasked_deg(host), 45, 2);
  Host later(servo_config(1));
  test::send(later, kReadAngle, 1ms);
  test::send(later, target(90), 1s);
  test::send(later, target(0), 2s);
  EXPECT_EQ(unasked_deg(later), 0);
}

TEST(Unasked, AWrappedTargetCountsAlthoughTheAngleIsKnown) {
  ServoConfig config = test::drive(Generation::kV236);
  Host host(config);
  const auto ask = [&](const protocol::Command& command) {
    host.ask(protocol::encode_query(1, command, host.bus.servo(1).format));
    host.wait(1ms);
  };
  ask(protocol::ClearAngle{21'474'836'00});
  ask(protocol::ReadMultiTurnAngle{});
  ASSERT_NEAR(static_cast<double>(host.multi_turn_cdeg()), 2'147'483'600, 1000);
  ask(protocol::Position1{2'147'483'647});
  host.wait(500ms);
  EXPECT_EQ(unasked_deg(host), 0);
  ask(protocol::Position1{static_cast<std::int32_t>(2'147'483'648U + 1000U)});
  host.wait(500ms);
  EXPECT_GT(unasked_deg(host), 100);
}

TEST(Unasked, MotionWithoutPowerDoesNotCount) {
  Host host(servo_config(1));
  test::send(host, kOff, 10ms);
  host.bus.apply({1, TurnShaft{90}});
  host.wait(1s);
  EXPECT_EQ(unasked_deg(host), 0);
}

TEST(Unasked, DoesNotDependOnWhereTheBusStops) {
  const auto run = [](SimTime step) {
    BusConfig config = test::bus_config({1, 2}, 1'000'000);
    Host host(config);
    host.bus.receive({1ms, target(200)});
    for (SimTime at{0}; at < 400ms; at += step) host.bus.advance_to(at);
    host.bus.advance_to(400ms);
    return std::array{unasked_deg(host), signal(host, "unasked_dps"), signal(host, "unasked_J")};
  };
  EXPECT_EQ(run(400ms), run(170us));
}

}  // namespace unasked_test
}  // namespace lk::emulator
