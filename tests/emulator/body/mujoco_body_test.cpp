// MuJoCo as a mechanism: refused models, state, failures; delivered models and their energy.

#include "emulator/body/mujoco_body.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "emulator/config/scenario/config_scenario.hpp"
#include "emulator/core/scenario/scenario_run.hpp"
#include "tests/emulator/body/body_support.hpp"
#include "tests/support/profile.hpp"

namespace lk::test {
namespace mujoco_body_test {

using namespace emulator;

/// Returns the message of the exception that `act` throws, or an empty string.
template <class Act>
std::string refusal(Act act) {
  try {
    act();
  } catch (const std::invalid_argument& problem) {
    return problem.what();
  }
  return "";
}
std::string refusal_of(const std::string& text) {
  return refusal([&] { body_of(text); });
}
void expect_contains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << text;
}

const std::string kArm =
    R"(<body><joint name="hip" axis="0 1 0"/><geom type="sphere" size=".1" mass="1" pos="0 0 -1"/></body>)";
/// Returns a model of the arm and `more` in the world, followed by `after`.
std::string with_arm(const std::string& more, const std::string& after = "") {
  return "<mujoco><worldbody>" + kArm + more + "</worldbody>" + after + "</mujoco>";
}
std::string with_mesh(const std::string& file) {
  return with_arm(R"(<geom type="mesh" mesh="m"/>)",
                  R"(<asset><mesh name="m" file=")" + file + R"("/></asset>)");
}

TEST(MujocoBody, RefusesFaultyModelsWithTheReason) {
  expect_contains(refusal_of("<mujoco><worldbody><body>"), "XML");
  expect_contains(refusal_of(with_mesh("no.stl")), "no.stl");
  expect_contains(refusal_of(R"(<mujoco><worldbody><body><joint name="a"/>
    <inertial pos="0 0 0" mass="0" diaginertia="0 0 0"/></body></worldbody></mujoco>)"),
                  "mass");
  expect_contains(refusal_of("<mujoco><worldbody/></mujoco>"), "no hinge");
  expect_contains(refusal_of(with_arm(R"(<body name="grain" pos="0 0 1">
    <composite type="particle" count="1000 1000 1" spacing="0.05"><geom size=".02"/></composite>
    </body>)")),
                  "needs more than 1 GiB of memory");
  EXPECT_EQ(refusal_of(with_arm("")), "");
}

TEST(MujocoBody, RefusesNumbersThatAreNotFinite) {
  const auto with = [](const std::string& option, const std::string& geom) {
    return refusal_of("<mujoco><option " + option + R"(/><worldbody><body name="nan 1">
      <!-- mass="nan" --><joint name="hip" axis="0 1 0"/><geom type="sphere" size=".1" )" +
                      geom + "/></body></worldbody></mujoco>");
  };
  EXPECT_EQ(with("", "mass='1'"), "");
  expect_contains(with("", "mass='nan'"), "mass=\"nan\" is not a finite number");
  expect_contains(with("", "mass='1' pos='0 0 -inf'"), "pos=\"0 0 -inf\"");
  expect_contains(with("gravity = '0 0 1e999'", "mass='1'"), "gravity=\"0 0 1e999\"");
}

/// Reads a model from a file, in a directory to which `prepare` adds others.
template <class Prepare>
std::string refusal_of_file(const std::string& text, Prepare prepare) {
  const TempDirectory directory;
  const std::string file = (directory.path() / "body.xml").string();
  std::ofstream(file) << text;
  prepare(directory.path());
  return refusal([&] { const MujocoBody body(file, std::chrono::milliseconds(1)); });
}

TEST(MujocoBody, ChecksIncludedFiles) {
  const std::string text = R"(<mujoco><worldbody><include file="arm.xml"/></worldbody></mujoco>)";
  const auto add_arm = [](const std::filesystem::path& directory) {
    std::ofstream(directory / "arm.xml")
        << R"(<mujoco><body><joint axis="0 1 0"/><geom size=".1" density="nan"/></body></mujoco>)";
  };
  expect_contains(refusal_of_file(text, add_arm), "arm.xml: density=\"nan\"");
}

/// It does not wait for a writer.
TEST(MujocoBody, RefusesAPipeAsMesh) {
  const auto add_pipe = [](const std::filesystem::path& directory) {
    EXPECT_EQ(::mkfifo((directory / "pipe.stl").c_str(), 0600), 0);
  };
  expect_contains(refusal_of_file(with_mesh("pipe.stl"), add_pipe), "pipe.stl");
}

TEST(MujocoBody, StartsInItsFirstKeyframe) {
  const auto body = body_of(with_arm("", R"(<keyframe><key qpos="0.7"/></keyframe>)"));
  EXPECT_EQ(body->joint(0).angle_rad, 0.7);
  EXPECT_NEAR(body->joint(0).inertia_kg_m2, 1 + 0.4 * 0.01, 1e-12);  // m·l² + 2/5·m·r²
  EXPECT_NEAR(body->joint(0).body_torque_Nm, -9.81 * std::sin(0.7), 1e-9);
}

/// In the air a joint feels the foot's inertia alone; on the floor it also feels the floor.
TEST(MujocoBody, FloorAddsToTheInertiaAtAJoint) {
  const auto leg = [](const char* height) {
    return body_of(
        std::string(R"(<mujoco><option timestep=".001"/><worldbody>
      <geom type="plane" size="1 1 1"/><body pos="0 0 )") +
        height +
        R"("><joint name="knee" axis="0 1 0"/><geom type="sphere" size=".1" mass="0.1" pos=".5 0 0"/>
      </body></worldbody></mujoco>)");
  };
  const double own = 0.1 * (0.25 + 0.4 * 0.01);
  EXPECT_NEAR(leg("1")->joint(0).inertia_kg_m2, own, 1e-9);
  EXPECT_GT(leg("0.0999")->joint(0).inertia_kg_m2, 3 * own);
}

/// A kilogram at one metre, pushed with 2 N for 10 ms: 2·0.01/(1 + 0.004) rad/s.
TEST(MujocoBody, CanBePushedLoadedAndFrozen) {
  const auto body = body_of(R"(<mujoco><option timestep=".001" gravity="0 0 0"/><worldbody>
      <body name="arm"><joint name="hip" axis="0 1 0"/><geom type="sphere" size=".1" mass="1"
      pos="0 0 -1"/></body></worldbody></mujoco>)");
  const JointTorque none[1] = {};
  ASSERT_EQ(body->parts().size(), 2U);
  body->push(1, {-2, 0, 0}, {0, 0, 0});
  body->update();
  for (int n = 0; n < 10; ++n) {
    body->advance(none);
    body->update();
  }
  body->push(1, {0, 0, 0}, {0, 0, 0});
  EXPECT_NEAR(body->joint(0).speed_rad_s, 0.02 / 1.004, 1e-6);
  body->carry(1, 2.0);
  body->update();
  EXPECT_NEAR(body->joint(0).inertia_kg_m2, 3.004, 1e-9);
  body->freeze(true);
  body->update();
  const double angle = body->joint(0).angle_rad;
  body->advance(none);
  EXPECT_EQ(body->joint(0).angle_rad, angle);
  EXPECT_EQ(body->joint(0).speed_rad_s, 0);
}

/// A kilogram at one metre with 0.004 kg·m² of its own; it hangs, so gravity pulls at 0.1 rad.
TEST(MujocoBody, ReadsUrdf) {
  const auto body = body_of(R"(<robot name="arm"><link name="base"/>
      <link name="arm"><inertial><origin xyz="0 0 -1"/><mass value="1"/>
        <inertia ixx="0.004" iyy="0.004" izz="0.004" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="hip" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
        <limit lower="-1" upper="2" effort="10" velocity="10"/></joint></robot>)");
  ASSERT_EQ(body->joints().size(), 1U);
  EXPECT_EQ(body->joints()[0], "hip");
  EXPECT_EQ(body->stops(0), (std::array{-1.0, 2.0}));
  EXPECT_FALSE(body->has_floor());
  body->pose({.keyframe = {}, .part = 0, .position_m = {}, .rpy_rad = {}, .joints = {{0, 0.1}}});
  body->update();
  EXPECT_NEAR(body->joint(0).inertia_kg_m2, 1.004, 1e-9);
  EXPECT_NEAR(body->joint(0).body_torque_Nm, -9.81 * std::sin(0.1), 1e-9);
}

TEST(MujocoBody, FailureNamesTheDivergingJoint) {
  const auto body = body_of(kDoublePendulum);
  const JointTorque torques[2] = {{0, 0}, {1e300, 0}};
  for (int n = 0; n < 10; ++n) {
    body->advance(torques);
    body->update();
  }
  ASSERT_TRUE(body->failure());
  expect_contains(*body->failure(), "out of bounds, at joint ");
  EXPECT_TRUE(body->clone()->failure());
}

// --- delivered models

const std::string kConfigs = std::string(LKEMU_SOURCE_DIR) + "/configs/";
std::string model_file(const std::string& model) { return kConfigs + "bodies/" + model + ".xml"; }

/// Reads a delivered scenario with its robot; `robot_file` gives the file for the robot's name.
template <class RobotFile>
Scenario delivered(const std::string& name, const LoadBody& load, RobotFile robot_file) {
  const auto robot = [&](const std::string& robot_name, const Overrides& overrides) {
    const std::string file = kConfigs + robot_file(robot_name);
    return parse_config(text_of(file), file, overrides, profile, load);
  };
  const std::string file = kConfigs + name;
  return parse_scenario(text_of(file), file, std::nullopt, {.robot = robot, .text = {}});
}

Scenario pendulum_swing() {
  const LoadBody load = [](const std::string& /*file*/, const std::string& model, SimTime step) {
    return std::make_shared<MujocoBody>(model_file(model), step);
  };
  return delivered("bodies/pendulum_swing.toml", load,
                   [](const std::string& robot) { return "bodies/" + robot; });
}

TEST(Pendulum, PassesItsScenario) {
  const Scenario scenario = pendulum_swing();
  ScenarioRun run(scenario);
  run.advance_to(scenario.duration);
  const Verdict verdict = run.verdict();
  EXPECT_EQ(verdict.outcome, Outcome::kPassed);
  for (const std::string& reason : verdict.invalid) ADD_FAILURE() << reason;
  for (const ExpectationResult& result : verdict.expectations) {
    EXPECT_EQ(result.status, ExpectationResult::Status::kPassed)
        << result.expected << ": " << result.measured;
  }
}

/// The drive is idle, and its gear is back-drivable.
TEST(Pendulum, PushDirectiveTurnsTheJoint) {
  Scenario scenario = pendulum_swing();
  scenario.expectations.clear();
  scenario.sends.clear();
  scenario.robot[0].events = {
      {std::chrono::milliseconds(10),
       {kWholeBus,
        BodyAct{
            Push{.part = 1, .force_N = {5, 0, 0}, .duration = std::chrono::milliseconds(100)}}}}};
  ScenarioRun pushed(scenario);
  scenario.robot[0].events.clear();
  ScenarioRun left(scenario);
  pushed.advance_to(std::chrono::milliseconds(111));
  left.advance_to(std::chrono::milliseconds(111));
  const double J = pushed.body()->joint(0).inertia_kg_m2;
  EXPECT_EQ(left.body()->joint(0).angle_rad, 0);
  // 5 N at the centre of mass, 0.275 m, minus the gear's friction: upwards, and below the bound.
  EXPECT_GT(pushed.body()->joint(0).speed_rad_s, 0.1);
  EXPECT_LT(pushed.body()->joint(0).speed_rad_s, 5 * 0.275 * 0.1 / J);
}

// --- energy between drives and joints is conserved, also when limbs hit the floor

struct Books {
  double given_J = 0;   // ∫τ·dq with the joint motion of the drives
  double taken_J = 0;   // with the joint motion of MuJoCo
  double passed_J = 0;  // absolute value of taken_J, summed
  int contacts = 0;     // largest number in a step
};

/// Accounts for the energy of its ports.
class Audited : public MujocoBody {
 public:
  Audited(const std::string& file, SimTime step, std::shared_ptr<Books> books)
      : MujocoBody(file, step), books_(std::move(books)) {}
  std::unique_ptr<Mechanism> clone() const override { return std::make_unique<Audited>(*this); }
  void advance(std::span<const JointTorque> torques) override {
    std::vector<double> before;
    for (std::size_t n = 0; n < torques.size(); ++n) before.push_back(joint(n).angle_rad);
    MujocoBody::advance(torques);
    for (std::size_t n = 0; n < torques.size(); ++n) {
      if (torques[n].mean_Nm == 0) continue;
      books_->given_J += torques[n].mean_Nm * (torques[n].angle_rad - before[n]);
      const double taken = torques[n].mean_Nm * (joint(n).angle_rad - before[n]);
      books_->taken_J += taken;
      books_->passed_J += std::abs(taken);
    }
    books_->contacts = std::max(books_->contacts, data().ncon);
  }

 private:
  std::shared_ptr<Books> books_;
};

/// Returns the energies of a delivered scenario at its end.
Books energy_of(const std::string& name) {
  const auto books = std::make_shared<Books>();
  const LoadBody load = [&](const std::string& /*file*/, const std::string& model, SimTime step) {
    return std::make_shared<Audited>(model_file(model), step, books);
  };
  const Scenario scenario = delivered("scenarios/" + name + ".toml", load,
                                      [](const auto& robot) { return "buses/" + robot + ".toml"; });
  ScenarioRun run(scenario);
  run.advance_to(scenario.duration);
  EXPECT_EQ(run.verdict().outcome, Outcome::kPassed) << name;
  return *books;
}

/// Two joints without contacts: 0.1 % of the transferred energy.
TEST(PortEnergy, IsConservedWithoutContacts) {
  const Books books = energy_of("arm_coupling_breaks");
  EXPECT_EQ(books.contacts, 0);
  EXPECT_GT(books.passed_J, 1);
  EXPECT_NEAR(books.given_J, books.taken_J, 1e-3 * books.passed_J);
}

/// Twelve joints in closed chains, each with the others' state of the previous step: the error is
/// 0.5 % (docs/guides/robots.md).
TEST(PortEnergy, IsNearlyConservedWithContacts) {
  const Books books = energy_of("dog_misses_a_command");
  EXPECT_GE(books.contacts, 4);
  EXPECT_GT(books.passed_J, 10);
  EXPECT_NEAR(books.given_J, books.taken_J, 1e-2 * books.passed_J);
  RecordProperty("residual", std::to_string((books.given_J - books.taken_J) / books.passed_J));
}

}  // namespace mujoco_body_test
}  // namespace lk::test
