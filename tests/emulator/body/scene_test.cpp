// Ground, initial pose, signals and visible shape of a MuJoCo body.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include "emulator/core/servo/signals.hpp"
#include "tests/emulator/body/body_support.hpp"

namespace lk::test {
namespace scene_test {

using emulator::BodyState;
using emulator::GeomKind;
using emulator::JointTorque;
using emulator::MujocoBody;
using emulator::Triple;

constexpr double kG = 9.81;
constexpr double kRad = std::numbers::pi / 180;

/// A block of 2 kg on the floor, and a nearly massless wheel, since a hinge is needed. The block's
/// own friction is high.
const char* const kBlock = R"(
<mujoco><compiler angle="degree"/><option timestep=".001" gravity="0 0 -9.81"/><worldbody>
  <geom name="floor" type="plane" size="9 9 1" friction="0.8 0.005 0.0001"/>
  <body name="block" pos="0 0 0.05"><freejoint/>
    <geom type="box" size=".2 .2 .05" mass="2" friction="1 0.005 0.0001"/></body>
  <body name="wheel" pos="0 0 2"><joint name="axle" axis="1 0 0" range="-90 45" limited="true"/>
    <geom type="sphere" size=".1" mass="0.1" contype="0" conaffinity="0"/></body>
</worldbody><keyframe><key name="there" qpos="0 0 .05 1 0 0 0 0"/>
  <key name="up" qpos="0 0 1 1 0 0 0 0.5"/></keyframe></mujoco>)";
constexpr std::size_t kPart = 1;

void run(MujocoBody& body, double seconds) {
  const JointTorque nothing[1] = {};
  for (int n = 0; n < std::lround(1e3 * seconds); ++n) {
    body.advance(nothing);
    body.update();
  }
}

/// Places the block at rest.
void place(MujocoBody& body, const Triple& position_m, const Triple& rpy_rad = {}) {
  body.pose(
      {.keyframe = {}, .part = kPart, .position_m = position_m, .rpy_rad = rpy_rad, .joints = {}});
}

void set_step(MujocoBody& body, const emulator::FloorStep& step) {
  body.set_floor({.friction = {}, .slope_rad = {}, .step = step});
}

BodyState state_of(const MujocoBody& body) {
  BodyState state;
  body.read_state(state);
  return state;
}

/// Returns the signal of that name, as used in conditions and CSV files.
double read(const MujocoBody& body, const std::string& name) {
  const BodyState state = state_of(body);
  const emulator::BodySignals signals(body.parts(), state);
  for (const emulator::Signal& signal : signals.all()) {
    if (signal.name == name) return signal.of_body(state, signal.part);
  }
  ADD_FAILURE() << "no signal " << name;
  return 0;
}

/// Returns the mean acceleration along x between 0.5 s and 1 s from now.
double acceleration_m_s2(MujocoBody& body) {
  run(body, 0.5);
  const double before = state_of(body).parts[kPart].speed_m_s[0];
  run(body, 0.5);
  return (state_of(body).parts[kPart].speed_m_s[0] - before) / 0.5;
}

/// A block on a slope of 20° with a friction of 0.2.
const double kSliding_m_s2 = kG * (std::sin(20 * kRad) - 0.2 * std::cos(20 * kRad));

/// It slides if tan(slope) exceeds the floor's friction, with g·(sin − μ·cos), in spite of its own
/// friction of 1. MuJoCo's friction is slightly soft: 3 %.
TEST(Scene, BlockSlidesDownASlopeAboveTheFrictionAngle) {
  const auto body = body_of(kBlock);
  body->set_floor({.friction = 0.2, .slope_rad = 20 * kRad});
  body->update();
  EXPECT_NEAR(acceleration_m_s2(*body), -kSliding_m_s2,
              0.03 * kSliding_m_s2);  // the slope rises along +x
}

/// tan 20° = 0.364 < 0.8. MuJoCo's friction allows slow creep.
TEST(Scene, BlockStaysOnASlopeBelowTheFrictionAngle) {
  const auto body = body_of(kBlock);
  body->set_floor({.friction = {}, .slope_rad = 20 * kRad});
  body->update();
  run(*body, 1);
  EXPECT_GT(state_of(*body).parts[kPart].position_m[0], -0.02);
  body->set_floor({.friction = {}, .slope_rad = 0.0});
  body->update();
  EXPECT_NEAR(body->model().opt.gravity[0], 0, 1e-12);
  EXPECT_NEAR(body->model().opt.gravity[2], -kG, 1e-12);
}

/// On a slope the floor carries m·g·cos.
TEST(Scene, FloorCarriesTheWeight) {
  const auto body = body_of(kBlock);
  run(*body, 1);
  EXPECT_NEAR(read(*body, "body.contact_N"), 2 * kG, 0.01 * 2 * kG);
  EXPECT_NEAR(read(*body, "body.block.contact_N"), 2 * kG, 0.01 * 2 * kG);
  EXPECT_EQ(read(*body, "body.wheel.contact_N"), 0);
  body->set_floor({.friction = {}, .slope_rad = 30 * kRad});
  body->update();
  run(*body, 0.2);
  EXPECT_NEAR(read(*body, "body.contact_N"), 2 * kG * std::cos(30 * kRad), 0.02 * 2 * kG);
}

/// It falls freely from its initial pose: 0.5·g·t² and g·t, by Euler with steps of 1 ms.
TEST(Scene, PoseIsAtRest) {
  const auto body = body_of(kBlock);
  run(*body, 0.1);
  body->pose({.keyframe = {},
              .part = kPart,
              .position_m = Triple{1, 2, 3},
              .rpy_rad = Triple{0, 0, 90 * kRad},
              .joints = {{0, -0.3}}});
  body->update();
  EXPECT_EQ(read(*body, "body.block.x_m"), 1);
  EXPECT_EQ(read(*body, "body.block.y_m"), 2);
  EXPECT_EQ(read(*body, "body.block.z_m"), 3);
  EXPECT_NEAR(read(*body, "body.block.yaw_deg"), 90, 1e-9);
  EXPECT_NEAR(read(*body, "body.block.roll_deg"), 0, 1e-9);
  // A quarter turn about z: cos 45° and sin 45°.
  const double half = std::sqrt(0.5);
  EXPECT_NEAR(body->data().qpos[body->model().jnt_qposadr[0] + 3], half, 1e-12);
  EXPECT_NEAR(body->data().qpos[body->model().jnt_qposadr[0] + 6], half, 1e-12);
  EXPECT_EQ(read(*body, "body.block.speed_m_s"), 0);
  EXPECT_EQ(body->joint(0).angle_rad, -0.3);
  EXPECT_EQ(body->joint(0).speed_rad_s, 0);
  run(*body, 0.1);
  EXPECT_NEAR(read(*body, "body.block.vz_m_s"), -0.1 * kG, 1e-9);
  EXPECT_NEAR(read(*body, "body.block.speed_m_s"), 0.1 * kG, 1e-9);
  EXPECT_NEAR(read(*body, "body.block.z_m"), 3 - 0.5 * kG * 0.1 * 0.101, 1e-9);
}

/// A quarter turn about x, then a half turn about y: (w, x, y, z) = (0, 0, cos 45°, −sin 45°), by
/// hand.
TEST(Scene, PoseTurnsAboutXThenYThenZ) {
  const auto body = body_of(kBlock);
  place(*body, {}, {90 * kRad, 180 * kRad, 0});
  const double expected[] = {0, 0, std::sqrt(0.5), -std::sqrt(0.5)};
  for (int n = 0; n < 4; ++n) {
    EXPECT_NEAR(body->data().qpos[body->model().jnt_qposadr[0] + 3 + n], expected[n], 1e-12) << n;
  }
}

TEST(Scene, KeyframeSetsThePose) {
  const auto body = body_of(kBlock);
  ASSERT_EQ(body->keyframes().size(), 2U);
  EXPECT_EQ(body->keyframes()[1], "up");
  body->pose({.keyframe = 1, .part = 0, .position_m = {}, .rpy_rad = {}, .joints = {}});
  body->update();
  EXPECT_EQ(state_of(*body).parts[kPart].position_m[2], 1);
  EXPECT_EQ(body->joint(0).angle_rad, 0.5);
}

/// Puts the block slightly above the floor and waits until it rests.
void set_down(MujocoBody& body, double x_m) {
  place(body, {x_m, 0, 0.2});
  body.update();
  run(body, 1);
}

/// The block is set down on either side of the edge; its centre is 0.05 m above its support.
TEST(Scene, StepCarriesTheBlock) {
  const auto body = body_of(kBlock);
  const auto height_at = [&](double x_m) {
    set_down(*body, x_m);
    return read(*body, "body.block.z_m") - 0.05;
  };
  EXPECT_NEAR(height_at(0.8), 0, 1e-3);
  set_step(*body, {0.08, 0.5});
  body->update();
  EXPECT_NEAR(height_at(0.8), 0.08, 1e-3);
  EXPECT_NEAR(read(*body, "body.contact_N"), 2 * kG, 0.01 * 2 * kG);
  EXPECT_EQ(read(*body, "body.fallen"), 1) << "it is the ground";
  EXPECT_NEAR(height_at(0.2), 0, 1e-3);
  set_step(*body, {});
  body->update();
  EXPECT_NEAR(height_at(0.8), 0, 1e-3);
}

/// `how` are attributes in <mujoco>, `planes` geoms in <worldbody>.
std::shared_ptr<MujocoBody> block_on(const std::string& planes, const std::string& how = "") {
  return body_of("<mujoco>" + how + R"(<option timestep=".001"/><worldbody>)" + planes + R"(
    <body name="block" pos="0.8 0 0.2"><freejoint/><geom type="box" size=".2 .2 .05" mass="2"/></body>
    <body name="wheel" pos="0 0 2"><joint name="axle" axis="1 0 0"/>
      <inertial pos="0 0 0" mass="0.1" diaginertia="1e-3 1e-3 1e-3"/></body>
    </worldbody></mujoco>)");
}

/// The step follows the world's x axis, for any frame of the plane, and also with a wall.
TEST(Scene, StepFollowsTheWorldAxisOnAnyFloor) {
  const char* const kFloors[] = {
      R"(<geom type="plane" size="9 9 1" pos="-2 0 0"/>)",
      R"(<geom type="plane" size="9 9 1" euler="0 0 180"/>)",
      R"(<geom type="plane" size="9 9 1" euler="0 90 0" pos="-3 0 0"/>
         <geom type="plane" size="9 9 1"/>)",
  };
  for (const std::string floor : kFloors) {
    const auto body = block_on(floor);
    set_step(*body, {0.08, 0.5});
    body->update();
    run(*body, 1);
    EXPECT_NEAR(read(*body, "body.block.z_m"), 0.13, 1e-3) << floor;
    set_down(*body, 0.2);
    EXPECT_NEAR(read(*body, "body.block.z_m"), 0.05, 1e-3) << floor;
  }
}

/// On a floor that rises by 10° along +x: 0.176 m at x = 1, and 0.08 m above that along its normal.
TEST(Scene, StepLiesOnATiltedFloor) {
  const auto body = block_on(R"(<geom type="plane" size="9 9 1" euler="0 -10 0"/>)");
  set_step(*body, {0.08, 0.5});
  place(*body, {1, 0, 0.4}, {0, -10 * kRad, 0});
  body->update();
  run(*body, 1);
  const Triple at = state_of(*body).parts[kPart].position_m;
  EXPECT_NEAR(at[2] * std::cos(10 * kRad) - at[0] * std::sin(10 * kRad), 0.13, 2e-3);
}

/// Such a model discards geoms without contacts.
TEST(Scene, StepWorksWhenTheModelDiscardsVisualGeoms) {
  const char* const kPlane = R"(<geom type="plane" size="9 9 1"/>)";
  const auto body = block_on(kPlane, R"(<compiler discardvisual="true"/>)");
  const auto untouched = block_on(kPlane);
  set_step(*body, {0, 0});
  body->update();
  run(*body, 0.5);
  run(*untouched, 0.5);
  EXPECT_EQ(state_of(*body).parts[kPart].position_m, state_of(*untouched).parts[kPart].position_m);
  set_step(*body, {0.08, -5});
  set_down(*body, 0);
  EXPECT_NEAR(read(*body, "body.block.z_m"), 0.13, 1e-3);
}

TEST(Scene, StepIsPartOfTheShape) {
  const auto body = body_of(kBlock);
  const auto boxes = [&] {
    const auto geoms = body->shape().geoms;
    return std::ranges::count_if(geoms, [](const emulator::BodyGeom& geom) {
      return geom.kind == GeomKind::kBox && !geom.body;
    });
  };
  EXPECT_EQ(boxes(), 0);
  set_step(*body, {0.08, 0.5});
  EXPECT_EQ(boxes(), 1);
  EXPECT_EQ(body->shape_changes(), 1U);
  set_step(*body, {});
  EXPECT_EQ(boxes(), 0);
  EXPECT_EQ(body->shape_changes(), 2U);
}

TEST(Scene, WallsAndGeomsOfBodiesAreNoFloor) {
  EXPECT_FALSE(block_on(R"(<geom type="plane" size="9 9 1" euler="0 90 0"/>)")->has_floor());
  EXPECT_FALSE(block_on(R"(<body><geom type="plane" size="9 9 1"/></body>)")->has_floor());
}

/// Towards the edge at x = 0.5, minus half of the block, 0.2 m.
TEST(Scene, StepStopsASlidingBlock) {
  const auto body = body_of(kBlock);
  body->set_floor({.friction = 0.01, .slope_rad = {}, .step = emulator::FloorStep{0.03, 0.5}});
  body->push(kPart, {4, 0, 0}, {});
  body->update();
  run(*body, 2);
  EXPECT_NEAR(read(*body, "body.block.x_m"), 0.3, 5e-3);
}

/// The step has the floor's friction: the block slides as in
/// BlockSlidesDownASlopeAboveTheFrictionAngle.
TEST(Scene, StepHasTheFrictionOfTheFloor) {
  for (const bool friction_first : {true, false}) {
    const auto body = body_of(kBlock);
    const emulator::FloorStep step{0.1, -5};
    if (friction_first) body->set_floor({.friction = 0.2, .slope_rad = {}});
    set_step(*body, step);
    place(*body, {0, 0, 0.15});
    if (!friction_first) body->set_floor({.friction = 0.2, .slope_rad = {}});
    body->set_floor({.friction = {}, .slope_rad = 20 * kRad});
    body->update();
    EXPECT_NEAR(acceleration_m_s2(*body), -kSliding_m_s2, 0.03 * kSliding_m_s2) << friction_first;
  }
}

TEST(Scene, ReportsFloorFreePartsAndStops) {
  const auto body = body_of(kBlock);
  EXPECT_TRUE(body->has_floor());
  ASSERT_EQ(body->free_parts().size(), 1U);
  EXPECT_EQ(body->free_parts().front(), kPart);
  EXPECT_NEAR(body->stops(0)->front(), -90 * kRad, 1e-12);
  EXPECT_NEAR(body->stops(0)->back(), 45 * kRad, 1e-12);
  const auto arm = body_of(kDoublePendulum);
  EXPECT_FALSE(arm->has_floor());
  EXPECT_TRUE(arm->free_parts().empty());
  EXPECT_FALSE(arm->stops(0));
}

/// In the air it counts as fallen only if tilted by more than 60°; on the floor it lies.
TEST(Scene, HasFallenWhenLyingOrTilted) {
  const auto body = body_of(kBlock);
  const auto tilted = [&](double degrees) {
    place(*body, {0, 0, 3}, {degrees * kRad, 0, 0});
    body->update();
    EXPECT_NEAR(read(*body, "body.block.roll_deg"), degrees, 1e-9);
    return read(*body, "body.fallen");
  };
  EXPECT_EQ(tilted(59.9), 0);
  EXPECT_EQ(tilted(60.1), 1);
  EXPECT_EQ(tilted(0), 0);
  run(*body, 1.5);
  EXPECT_EQ(read(*body, "body.fallen"), 1);
}

/// A table with one swinging leg: on the leg's end it stands, on its own corner it has fallen.
TEST(Scene, HasNotFallenWhileOnlyFeetTouchTheFloor) {
  const auto table = [](const char* height) {
    return body_of(std::string(R"(<mujoco><worldbody><geom type="plane" size="9 9 1"/>
      <body name="top" pos="0 0 )") +
                   height + R"("><freejoint/><geom type="box" size=".3 .3 .01" mass="1"/>
      <body name="upper"><joint name="hip" axis="0 1 0"/><geom type="sphere" size=".005" mass=".1"/>
      <body name="foot" pos="0 0 -.5"><joint name="knee" axis="0 1 0"/>
        <geom type="sphere" size=".005" mass=".1"/></body></body></body>
      </worldbody></mujoco>)");
  };
  const auto stands = table("0.504");  // 1 mm into the floor
  EXPECT_GT(read(*stands, "body.foot.contact_N"), 0);
  EXPECT_EQ(read(*stands, "body.fallen"), 0);
  const auto lies = table("0.009");
  lies->pose({.keyframe = {},
              .part = 0,
              .position_m = {},
              .rpy_rad = {},
              .joints = {{0, 0.5 * std::numbers::pi}}});  // the leg is horizontal
  lies->update();
  EXPECT_GT(read(*lies, "body.top.contact_N"), 0);
  EXPECT_EQ(read(*lies, "body.fallen"), 1);
}

TEST(Scene, CopyHasItsOwnFloor) {
  const auto body = body_of(kBlock);
  const auto copy = body->clone();
  copy->set_floor({.friction = 0.1, .slope_rad = 0.3, .step = emulator::FloorStep{0.1, 0}});
  body->update();
  EXPECT_EQ(body->shape_changes(), 0U);
  EXPECT_EQ(body->model().opt.gravity[0], 0);
  EXPECT_EQ(body->model().geom_friction[0], 0.8);
}

// --- visible shape: solids, poses, contacts

/// By hand from the file: a mount, and a tube of 0.3 m with a ball at its end; the capsule's centre
/// is half-way down.
TEST(BodyShape, MatchesThePendulumFile) {
  const auto shape = body_of(text_of(LKEMU_SOURCE_DIR "/configs/bodies/pendulum.xml"))->shape();
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

TEST(BodyShape, FollowsBodiesAxesColoursAndGroupsOfTheModel) {
  const auto body = body_of(kOnTheFloor);
  const emulator::BodyShape shape = body->shape();
  ASSERT_EQ(shape.geoms.size(), 3U) << "group 3 is not shown";
  EXPECT_FALSE(shape.geoms[0].body);
  EXPECT_EQ(shape.geoms[0].kind, GeomKind::kPlane);
  EXPECT_EQ(shape.geoms[0].size_m[0], 0) << "without end";
  EXPECT_EQ(shape.geoms[1].colour, (std::array<double, 4>{1, 0, 0, 0.5})) << "the material's";
  EXPECT_TRUE(shape.bodies[0].free);
  EXPECT_FALSE(shape.bodies[1].free);
  EXPECT_EQ(shape.joints[0].body, 1U);
  EXPECT_EQ(shape.joints[0].axis, (Triple{0, 0, 1})) << "of unit length";
  const std::vector<emulator::BodyPose> poses = body->poses();
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_EQ(poses[0].position_m, (Triple{1, 2, 0.0999}));
  EXPECT_NEAR(poses[1].position_m[2], 0.1999, 1e-12);
  EXPECT_NEAR(std::abs(poses[1].quaternion[3]), 1, 1e-12) << "half a turn about z, as its trunk";
}

/// A pyramid of 0.4 m; MuJoCo turns and moves its mesh, and the geom's pose undoes this.
TEST(BodyShape, MeshesHaveTheTrianglesOfTheModel) {
  const auto shape = body_of(R"(<mujoco><asset>
    <mesh name="pyramid" vertex="-.2 -.2 0  .2 -.2 0  .2 .2 0  -.2 .2 0  0 0 .4"/></asset>
    <worldbody><body><joint name="hinge" axis="0 0 1"/>
    <geom type="mesh" mesh="pyramid" mass="1"/><geom type="mesh" mesh="pyramid" mass="1" pos="1 0 0"/>
    </body></worldbody></mujoco>)")
                         ->shape();
  ASSERT_EQ(shape.geoms.size(), 2U);
  for (const emulator::BodyGeom& geom : shape.geoms) {
    EXPECT_EQ(geom.kind, GeomKind::kMesh);
    EXPECT_EQ(geom.mesh, 0U);
  }
  ASSERT_EQ(shape.meshes.size(), 1U) << "shared";
  EXPECT_EQ(shape.meshes[0].faces.size(), 3 * 6U) << "four sides, and a foot of two triangles";
  const std::vector<float>& vertices = shape.meshes[0].vertices_m;
  ASSERT_EQ(vertices.size(), 3 * 5U);
  const auto distance = [&](std::size_t one, std::size_t other) {
    double square = 0;
    for (std::size_t n = 0; n < 3; ++n)
      square += std::pow(vertices[3 * one + n] - vertices[3 * other + n], 2);
    return std::sqrt(square);
  };
  EXPECT_NEAR(distance(0, 1), 0.4, 1e-6) << "a side of the foot";
  EXPECT_NEAR(distance(0, 4), std::sqrt(0.04 + 0.04 + 0.16), 1e-6) << "an edge to the tip";
}

/// At rest the floor carries the whole weight: 3 kg.
TEST(BodyShape, ContactForcesCarryTheWeight) {
  const auto body = body_of(kOnTheFloor);
  run(*body, 3);
  double up = 0;
  double aside = 0;
  for (const emulator::BodyContact& contact : body->contacts()) {
    EXPECT_NEAR(contact.point_m[2], 0, 2e-3);
    up += contact.force_N[2];
    aside += std::abs(contact.force_N[0]) + std::abs(contact.force_N[1]);
  }
  EXPECT_NEAR(up, 3 * 9.81, 1e-3 * 3 * 9.81);
  EXPECT_LT(aside, 0.1);
}

/// The floor may be the model's first geom or its last: the force acts on the moving body.
TEST(BodyShape, ContactForcesActOnTheMovingBody) {
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

}  // namespace scene_test
}  // namespace lk::test
