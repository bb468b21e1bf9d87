// Lines whose drives share a body: the running program moves it as a scenario does.
#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <memory>

#include "emulator/core/scenario/scenario_run.hpp"
#include "emulator/io/live/world.hpp"
#include "tests/emulator/coupling/hand_bodies.hpp"
#include "tests/support/bus_config.hpp"

namespace lk::emulator {
namespace body_world_test {

using namespace std::chrono_literals;

/// Two buses with one drive each, on the joints of a falling double pendulum.
std::vector<BusConfig> robot() {
  const auto body = std::make_shared<test::HandBody>(2, test::double_pendulum(0.3, 0.25),
                                                     SimTime(1ms), test::Two{1.0, -0.4});
  std::vector<BusConfig> buses;
  for (std::size_t n = 0; n < 2; ++n) {
    buses.push_back(test::bus_config({1}));
    buses.back().interface = "test" + std::to_string(n);
    buses.back().body = body;
    buses.back().servos.front().joint =
        JointLink{.joint = n, .start_rad = body->joint(n).angle_rad};
  }
  return buses;
}

TEST(BodyWorld, FollowsTheSteppedClockAsInAScenario) {
  boost::asio::io_context loop{1};
  World world(loop, {.stepped = true});
  for (const BusConfig& bus : robot()) world.add(bus);
  world.start();
  for (const SimTime to : {SimTime(300us), SimTime(1ms), SimTime(40'700us), SimTime(50ms)}) {
    bool there = false;
    world.advance(to, [&](World::Advanced how) { there = how == World::Advanced::kReached; });
    while (!there) {
      loop.restart();
      ASSERT_GT(loop.run_one_for(10s), 0U);
    }
  }
  Scenario scenario;
  scenario.robot = robot();
  ScenarioRun run(scenario);
  run.advance_to(50ms);
  for (std::size_t n = 0; n < 2; ++n) {
    const DriveView live = world.lines()[n]->bus().view(1);
    const DriveView alone = run.bus(n).view(1);
    EXPECT_EQ(live.joint.angle_rad, alone.joint.angle_rad);
    EXPECT_EQ(live.joint.torque_Nm, alone.joint.torque_Nm);
    EXPECT_EQ(live.truth.theta_m, alone.truth.theta_m);
    EXPECT_NE(live.joint.angle_rad, robot()[n].servos.front().joint->start_rad);
  }
}

}  // namespace body_world_test
}  // namespace lk::emulator
