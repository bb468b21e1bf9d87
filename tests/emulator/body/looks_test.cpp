// Visible data of a MuJoCo body: its solids, their poses, their contacts.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "tests/emulator/body/body_support.hpp"

namespace lk::test {
namespace looks_test {

using emulator::BodyContact;
using emulator::BodyPose;
using emulator::BodyShape;
using emulator::GeomKind;
using emulator::Triple;

/// By hand from the file: a mount, and a tube of 0.3 m with a ball at its end; the capsule's centre
/// is half-way down.
TEST(Looks, OfThePendulumAreThoseOfItsFile) {
  std::ostringstream text;
  text << std::ifstream(LKEMU_SOURCE_DIR "/configs/bodies/pendulum.xml").rdbuf();
  const BodyShape shape = body_of(text.str())->shape();
  ASSERT_EQ(shape.bodies.size(), 1U);
  EXPECT_EQ(shape.bodies[0].name, "arm");
  EXPECT_FALSE(shape.bodies[0].free);
  EXPECT_NEAR(shape.mass_kg, 0.1 + 0.5, 1e-12);
  EXPECT_NEAR(shape.bodies[0].centre_m[2], -(0.1 * 0.15 + 0.5 * 0.3) / 0.6, 1e-9);
  ASSERT_EQ(shape.geoms.size(), 3U);
  EXPECT_EQ(shape.geoms[0].kind, GeomKind::kBox);
  EXPECT_EQ(shape.geoms[1].kind, GeomKind::kCapsule);
  EXPECT_NEAR(shape.geoms[1].size_m[0], 0.008, 1e-12);
  EXPECT_NEAR(shape.geoms[1].size_m[1], 0.15, 1e-12);
  EXPECT_NEAR(shape.geoms[1].position_m[2], -0.15, 1e-12);
  EXPECT_EQ(shape.geoms[2].kind, GeomKind::kSphere);
  EXPECT_EQ(shape.geoms[2].body, 0U);
  ASSERT_EQ(shape.joints.size(), 1U);
  EXPECT_EQ(shape.joints[0].axis, (Triple{0, -1, 0}));
}

const char* const kOnTheFloor = R"(<mujoco><option timestep=".001"/>
  <asset><material name="red" rgba="1 0 0 0.5"/></asset>
  <worldbody><geom type="plane" size="0 0 1"/>
  <body name="trunk" pos="1 2 0.0999" quat="0 0 0 1"><freejoint/><geom type="box" size=".1 .1 .1" mass="2" material="red"/>
    <geom type="sphere" size=".01" mass="0" group="3"/>
    <body name="fin" pos="0 0 .1"><joint name="hinge" axis="0 0 2"/><geom type="cylinder" size=".01 .02" mass="1"/></body>
  </body></worldbody></mujoco>)";

TEST(Looks, AreInTheWorldOnABodyAndHiddenAsTheModelSays) {
  const auto body = body_of(kOnTheFloor);
  const BodyShape shape = body->shape();
  ASSERT_EQ(shape.geoms.size(), 3U) << "group 3 is not shown";
  EXPECT_FALSE(shape.geoms[0].body);
  EXPECT_EQ(shape.geoms[0].kind, GeomKind::kPlane);
  EXPECT_EQ(shape.geoms[0].size_m[0], 0) << "without end";
  EXPECT_EQ(shape.geoms[1].colour, (std::array<double, 4>{1, 0, 0, 0.5})) << "the material's";
  EXPECT_TRUE(shape.bodies[0].free);
  EXPECT_FALSE(shape.bodies[1].free);
  EXPECT_EQ(shape.joints[0].body, 1U);
  EXPECT_EQ(shape.joints[0].axis, (Triple{0, 0, 1})) << "of unit length";
  const std::vector<BodyPose> poses = body->poses();
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_EQ(poses[0].position_m, (Triple{1, 2, 0.0999}));
  EXPECT_NEAR(poses[1].position_m[2], 0.1999, 1e-12);
  EXPECT_NEAR(std::abs(poses[1].quaternion[3]), 1, 1e-12) << "half a turn about z, as its trunk";
}

/// At rest the floor carries the whole weight: 3 kg.
TEST(Looks, ContactForcesCarryTheWeight) {
  const auto body = body_of(kOnTheFloor);
  const emulator::JointTorque none{};
  for (int n = 0; n < 3000; ++n) {
    body->advance({&none, 1});
    body->update();
  }
  double up = 0;
  double aside = 0;
  for (const BodyContact& contact : body->contacts()) {
    EXPECT_NEAR(contact.point_m[2], 0, 2e-3);
    up += contact.force_N[2];
    aside += std::abs(contact.force_N[0]) + std::abs(contact.force_N[1]);
  }
  EXPECT_NEAR(up, 3 * 9.81, 1e-3 * 3 * 9.81);
  EXPECT_LT(aside, 0.1);
}

/// The floor may be the model's first geom or its last: the force acts on the moving body.
TEST(Looks, ContactForcesAreOnWhatMoves) {
  for (const bool floor_first : {true, false}) {
    const std::string floor = R"(<geom type="box" size="1 1 .1" pos="0 0 -.1"/>)";
    const std::string ball =
        R"(<body pos="0 0 .0999"><freejoint/><geom type="sphere" size=".1" mass="1"/></body>)";
    const std::string arm =
        R"(<body pos="5 0 5"><joint name="hip" axis="0 1 0"/><geom type="sphere" size=".1" mass="1"/></body>)";
    const std::string late = floor_first ? floor + ball : ball + "<body>" + floor + "</body>";
    const auto body = body_of("<mujoco><worldbody>" + late + arm + "</worldbody></mujoco>");
    ASSERT_EQ(body->contacts().size(), 1U);
    EXPECT_GT(body->contacts()[0].force_N[2], 0) << floor_first;
  }
}

}  // namespace looks_test
}  // namespace lk::test
