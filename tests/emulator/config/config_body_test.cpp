// [body] and the joints of drives in robot files (docs/guides/robots.md).

#include "emulator/config/config_body.hpp"

#include <gtest/gtest.h>

#include "emulator/config/scenario/config_scenario.hpp"
#include "emulator/core/scenario/scenario_run.hpp"
#include "emulator/core/servo/signals.hpp"
#include "tests/emulator/config/config_support.hpp"
#include "tests/emulator/coupling/hand_bodies.hpp"

namespace lk::emulator {
namespace config_body_test {

const std::string kRobot = "[body]\nmodel = \"arm.xml\"\n[[bus]]\ninterface = \"vcan0\"\n";
const std::string kDrive = "[[bus.drive]]\nid = 1\n";

/// Two joints, the second at 0.5 rad.
std::shared_ptr<const Mechanism> load(const std::string& file, const std::string& model,
                                      SimTime step) {
  if (model != "arm.xml") throw std::invalid_argument("no " + model + " beside " + file);
  return std::make_shared<test::HandBody>(2, test::double_pendulum(1, 1), step, test::Two{0, 0.5});
}

std::vector<BusConfig> read(const std::string& text, const LoadBody& by = load) {
  return parse_config(text, "robot.toml", {}, find_test_profile, by);
}
std::string error(const std::string& text, const LoadBody& by = load) {
  return config_error([&] { read(text, by); });
}

TEST(ConfigBody, ReadsJointsOfDrives) {
  const auto buses =
      read(kRobot + kDrive + "joint = \"joint_0\"\n" + "[[bus.drive]]\nid = 2\n" +
           "joint = { name = \"joint_1\", direction = -1, ratio = 2, offset_deg = 90 }");
  ASSERT_TRUE(buses[0].body);
  EXPECT_EQ(buses[0].body->step(), std::chrono::milliseconds(1));
  EXPECT_EQ(buses[0].servos[0].joint->joint, 0U);
  const JointLink& second = *buses[0].servos[1].joint;
  EXPECT_EQ(second.joint, 1U);
  EXPECT_EQ(second.rate, -2);
  EXPECT_EQ(second.start_rad, 0.5);
  EXPECT_NEAR(second.output_of(3.14159265 / 2), 0, 1e-8);
  EXPECT_NEAR(second.output_of(0), 3.14159265, 1e-8);
}

TEST(ConfigBody, RejectsBootAngleOfAJointDrive) {
  Overrides overrides;
  overrides.boot_angle_deg = 0;
  const auto start = [&] {
    parse_config(kRobot + kDrive + "joint = \"joint_0\"\n", "robot.toml", overrides,
                 find_test_profile, load);
  };
  EXPECT_EQ(config_error(start),
            "--boot-angle: vcan0 drive 1 has a joint: the body sets its start angle");
}

TEST(ConfigBody, ErrorsNameTheRemedy) {
  const std::string drive = kRobot + kDrive;
  EXPECT_EQ(
      error(drive, {}),
      "robot.toml:1: body: this robot needs the package lk-emu-body: run lk-emu-body instead");
  EXPECT_EQ(error(drive + "joint = \"joint_3\""),
            "robot.toml:7: bus.drive.joint: \"joint_3\" is not one of joint_0, joint_1");
  EXPECT_EQ(error(drive + "joint = \"joint_0\"\n[[bus.drive]]\nid = 2\njoint = \"joint_0\""),
            "robot.toml:10: bus.drive.joint: another drive turns this joint already");
  EXPECT_EQ(
      error(drive + "joint = \"joint_0\"\nload = { tau_Nm = 1 }"),
      "robot.toml:8: bus.drive.load: not allowed for a drive with a joint: the body is its load");
  EXPECT_EQ(error(drive + "joint = \"joint_0\"\nboot_angle_deg = 1"),
            "robot.toml:8: bus.drive.boot_angle_deg: not allowed for a drive with a joint: the "
            "body sets its angle; use offset_deg");
  EXPECT_EQ(error("[body]\nmodel = \"leg.xml\"\n"),
            "robot.toml:2: body.model: no leg.xml beside robot.toml");
  EXPECT_EQ(error("[[bus]]\ninterface = \"vcan0\"\n" + kDrive + "joint = \"joint_0\""),
            "robot.toml:5: bus.drive.joint: the robot has no [body]");
  const std::string odd =
      "[body]\nmodel = \"arm.xml\"\nstep_ms = 0.99\n[[bus]]\ninterface = \"vcan0\"\n";
  EXPECT_NE(error(odd + kDrive + "joint = \"joint_0\"")
                .find("is not a multiple of this drive's PWM period"),
            std::string::npos);
}

TEST(ConfigBody, RejectsLoadsAndTurnsOfJointDrives) {
  const std::string event = kRobot + kDrive + "joint = \"joint_0\"\n[[bus.event]]\nat_s = 1\n";
  for (const char* const action : {"turn_deg = 3", "load = { tau_Nm = 1 }"}) {
    EXPECT_NE(error(event + action).find("drive 1 turns a joint of the body: the body is its load"),
              std::string::npos)
        << action;
  }
  EXPECT_EQ(error(event + "freeze = true"), "accepted");
  EXPECT_NE(
      error("[[bus]]\ninterface = \"vcan0\"\n" + kDrive + "[[bus.event]]\nat_s = 1\nfreeze = true")
          .find("the robot has no [body]"),
      std::string::npos);
}

// --- actions on a body and its signals

/// A body with a free trunk on a floor.
class Walker : public test::HandBody {
 public:
  explicit Walker(SimTime step) : HandBody(2, test::double_pendulum(1, 1), step) {}
  std::unique_ptr<Mechanism> clone() const override { return std::make_unique<Walker>(*this); }
  std::span<const std::string> parts() const override { return parts_; }
  std::span<const std::string> keyframes() const override { return keyframes_; }
  std::span<const std::size_t> free_parts() const override { return free_; }
  std::optional<std::array<double, 2>> stops(std::size_t joint) const override {
    return joint == 0 ? std::optional(std::array{-0.5, 0.5}) : std::nullopt;
  }
  bool has_floor() const override { return true; }
  /// The trunk is at x = its first angle; its joint 1 touches the floor.
  void read_state(BodyState& state) const override {
    state.parts.resize(2);
    state.parts[1].position_m = {angles()[0], 0, 0.3};
    state.contact_N = 9.81;
  }

 private:
  std::vector<std::string> parts_{"", "trunk"};
  std::vector<std::string> keyframes_{"lies", ""};
  std::vector<std::size_t> free_{1};
};

std::shared_ptr<const Mechanism> walker(const std::string& /*file*/, const std::string& /*model*/,
                                        SimTime step) {
  return std::make_shared<Walker>(step);
}

const std::string kEvent = kRobot + kDrive + "joint = \"joint_0\"\n[[bus.event]]\nat_s = 1\n";

template <class Act>
Act act(const std::string& words) {
  const auto buses = read(kEvent + words, walker);
  const auto& event = buses.at(0).events.at(0);
  EXPECT_EQ(event.directive.id, kWholeBus);
  return std::get<Act>(std::get<BodyAct>(event.directive.what).what);
}

TEST(ConfigBody, ReadsFloorEvents) {
  const auto floor = act<Floor>("floor = { friction = 0.3, slope_deg = 10 }");
  EXPECT_EQ(floor.friction, 0.3);
  EXPECT_NEAR(floor.slope_rad.value(), 0.174532925, 1e-9);
  EXPECT_FALSE(act<Floor>("floor = { slope_deg = -3 }").friction);
  const auto step = act<Floor>("floor = { step_m = 0.05, step_at_x_m = 0.4 }").step.value();
  EXPECT_EQ(step.height_m, 0.05);
  EXPECT_EQ(step.from_x_m, 0.4);
  EXPECT_EQ(act<Floor>("floor = { step_m = 0 }").step.value().height_m, 0);
  EXPECT_EQ(error(kEvent + "floor = { step_m = 0.05 }", walker),
            "robot.toml:10: bus.event.floor.step_at_x_m: missing");
  EXPECT_EQ(error(kEvent + "floor = { step_at_x_m = 1 }", walker),
            "robot.toml:10: bus.event.floor.step_m: missing");
  EXPECT_EQ(error(kEvent + "floor = { friction = 0 }", walker),
            "robot.toml:10: bus.event.floor.friction: 0 is out of range (1e-05 to 10)");
  EXPECT_EQ(error(kEvent + "floor = {}", walker),
            "robot.toml:10: bus.event.floor.friction: missing");
  EXPECT_EQ(error(kEvent + "floor = { friction = 1 }"),
            "robot.toml:10: bus.event.floor: the model has no floor: no plane of its worldbody, "
            "but walls");
  EXPECT_EQ(error(kEvent + "floor = { friction = 1 }\nid = 1", walker),
            "robot.toml:11: bus.event.id: a body action acts on the whole bus; remove this key");
}

TEST(ConfigBody, ReadsPoseEvents) {
  const auto pose = act<Pose>(
      "pose = { keyframe = \"lies\", position_m = [1, 2, 3], rpy_deg = [90, 180, 0], "
      "joints_deg = { joint_1 = 90 } }");
  EXPECT_EQ(pose.keyframe, 0U);
  EXPECT_EQ(pose.part, 1U);
  EXPECT_EQ(pose.position_m, (Triple{1, 2, 3}));
  const Triple rpy_rad = pose.rpy_rad.value();
  EXPECT_NEAR(rpy_rad[0], 1.57079633, 1e-8);
  EXPECT_NEAR(rpy_rad[1], 3.14159265, 1e-8);
  EXPECT_EQ(rpy_rad[2], 0);
  ASSERT_EQ(pose.joints.size(), 1U);
  EXPECT_EQ(pose.joints[0].joint, 1U);
  EXPECT_NEAR(pose.joints[0].angle_rad, 1.57079633, 1e-8);
}

TEST(ConfigBody, RejectsMalformedPoses) {
  const auto wrong = [](const std::string& pose) {
    return error(kEvent + "pose = " + pose, walker);
  };
  EXPECT_EQ(wrong("{}"),
            "robot.toml:10: bus.event.pose: needs one of keyframe, position_m, rpy_deg and "
            "joints_deg");
  EXPECT_EQ(wrong("{ keyframe = \"stands\" }"),
            "robot.toml:10: bus.event.pose.keyframe: \"stands\" is not one of lies");
  EXPECT_EQ(wrong("{ joints_deg = { joint_0 = 30 } }"),
            "robot.toml:10: bus.event.pose.joints_deg.joint_0: is out of range (-28.6479 to "
            "28.6479 degrees)");
  EXPECT_NE(wrong("{ joints_deg = { joint_7 = 30 } }").find("joints_deg.joint_7: unknown"),
            std::string::npos);
  EXPECT_EQ(error(kEvent + "pose = { position_m = [0, 0, 1] }"),
            "robot.toml:10: bus.event.pose.position_m: the model has no free body");
  EXPECT_EQ(error(kEvent + "pose = { keyframe = \"lies\" }"),
            "robot.toml:10: bus.event.pose.keyframe: the model has no keyframe with a name");
  EXPECT_EQ(error(kEvent + "push = { body = \"tail\", force_N = [1, 0, 0], for_s = 1 }", walker),
            "robot.toml:10: bus.event.push.body: \"tail\" is not one of trunk");
  EXPECT_EQ(error("[[bus]]\ninterface = \"vcan0\"\n" + kDrive +
                  "[[bus.event]]\nat_s = 1\npose = { position_m = [0, 0, 1] }"),
            "robot.toml:7: bus.event.pose: the robot has no [body]");
}

TEST(ConfigBody, ReadsConditionsOnBodySignals) {
  const std::string event = kRobot + kDrive + "joint = \"joint_0\"\n[[bus.event]]\nmark = \"m\"\n";
  const auto buses = read(event + "when = { signal = \"body.trunk.x_m\", above = 0.1 }", walker);
  const auto& when = buses[0].events[0].when.value();
  EXPECT_EQ(std::get<SignalReaches>(when.what).signal->name, "body.trunk.x_m");
  EXPECT_EQ(error(event + "when = { id = 1, signal = \"body.fallen\", above = 1 }", walker),
            "robot.toml:10: bus.event.when.id: a body signal belongs to no drive; remove this key");
  EXPECT_NE(error(event + "when = { signal = \"body.tail.x_m\", above = 1 }", walker)
                .find("robot.toml:10: bus.event.when.signal: \"body.tail.x_m\" is not one of "),
            std::string::npos);
  EXPECT_EQ(error("[[bus]]\ninterface = \"vcan0\"\n" + kDrive +
                  "[[bus.event]]\nmark = \"m\"\nwhen = { signal = \"body.fallen\", above = 1 }"),
            "robot.toml:7: bus.event.when.signal: the robot has no [body]");
}

const ScenarioFiles kWalker{
    .robot =
        [](const std::string& name, const Overrides& overrides) {
          const std::string drive = name == "walker" ? kDrive + "joint = \"joint_0\"\n" : kDrive;
          const std::string head = "[[bus]]\ninterface = \"vcan0\"\n";
          return parse_config((name == "walker" ? kRobot : head) + drive, "robot.toml", overrides,
                              find_test_profile, walker);
        },
    .text = {}};

Scenario scenario(const std::string& robot, const std::string& tables) {
  return parse_scenario("robot = \"" + robot + "\"\nduration_s = 1\n" + tables, "s.toml",
                        std::nullopt, kWalker);
}

/// It hangs at rest and is moved to x = 0.2.
TEST(ConfigBody, ReadsExpectationsOnBodySignals) {
  const Scenario walks = scenario("walker", R"(
[[event]]
at_s = 0.5
pose = { joints_deg = { joint_0 = 11.459155902616464 } }
[[expect]]
signal = "body.trunk.x_m"
min = -0.001
max = 0.001
at_s = 0.499
[[expect]]
signal = "body.trunk.x_m"
min = 0.199
max = 0.201
at_s = 0.501
[[expect]]
signal = "body.contact_N"
max = 9
at_s = 0.9
)");
  ScenarioRun run(walks);
  run.advance_to(walks.duration);
  const Verdict verdict = run.verdict();
  ASSERT_EQ(verdict.expectations.size(), 3U);
  EXPECT_EQ(verdict.expectations[0].status, ExpectationResult::Status::kPassed);
  EXPECT_EQ(verdict.expectations[1].status, ExpectationResult::Status::kPassed)
      << verdict.expectations[1].measured;
  EXPECT_EQ(verdict.expectations[2].status, ExpectationResult::Status::kFailed);
  EXPECT_EQ(verdict.expectations[2].expected, "body.contact_N at most 9 at 0.9 s");
  EXPECT_EQ(verdict.expectations[2].measured, "9.81 at 0.9 s");
}

TEST(ConfigBody, RequiresADriveWithAJoint) {
  EXPECT_EQ(error(kRobot + kDrive),
            "robot.toml:1: body: no drive turns a joint of the body: give a drive `joint`, or "
            "remove [body]");
  // The command line may omit that drive: the body is unchanged then.
  Overrides others;
  others.buses.push_back({.interface = "vcan0", .ids = std::vector{2}});
  const std::string text = kRobot + kDrive + "joint = \"joint_0\"\n[[bus.drive]]\nid = 2\n";
  EXPECT_EQ(parse_config(text, "robot.toml", others, find_test_profile, load)[0].servos.size(), 1U);
}

TEST(ConfigBody, RejectsExpectationsWithoutABody) {
  const auto wrong = [](const std::string& robot, const std::string& words) {
    return config_error([&] { scenario(robot, "[[expect]]\n" + words); });
  };
  EXPECT_EQ(wrong("drive", "signal = \"body.fallen\"\nmax = 0"),
            "s.toml:4: expect.signal: the robot has no [body]");
  EXPECT_EQ(wrong("walker", "signal = \"body.fallen\"\nmax = 0\nid = 1"),
            "s.toml:6: expect.id: a body signal belongs to no drive; remove this key");
}

}  // namespace config_body_test
}  // namespace lk::emulator
