// The robot's body in the control interface: shapes and poses.

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <numbers>
#include <string>
#include <vector>

#include "emulator/core/coupling/drawable_body.hpp"
#include "emulator/core/servo/signals.hpp"
#include "emulator/io/control/streams.hpp"
#include "tests/emulator/control/http_support.hpp"

namespace lk::emulator {
namespace control_body_test {

/// A wheel on an axle that falls by 1 mm each step and has a contact from 2 ms on.
class Wheel : public Mechanism, public DrawableBody {
 public:
  std::unique_ptr<Mechanism> clone() const override { return std::make_unique<Wheel>(*this); }
  SimTime step() const override { return std::chrono::milliseconds(1); }
  std::span<const std::string> joints() const override { return names_; }
  JointView joint(std::size_t /*joint*/) const override { return {0, 0, 1, 0}; }
  void set_armature(std::size_t /*joint*/, double /*inertia*/) override {}
  void update() override {}
  void advance(std::span<const JointTorque> /*torques*/) override { ++steps_; }
  std::span<const std::string> parts() const override { return parts_; }
  void read_state(BodyState& state) const override {
    state.parts = {{}, {.position_m = {1.5, 0, -1e-3 * steps_}}};
    state.contact_N = steps_ < 2 ? 0 : 19.62;
  }
  void push(std::size_t /*part*/, const Triple& /*force*/, const Triple& /*torque*/) override {}
  void carry(std::size_t /*part*/, double /*mass*/) override {}
  void freeze(bool /*on*/) override {}
  std::optional<std::string> failure() const override { return std::nullopt; }
  BodyShape shape() const override {
    return {.mass_kg = 2,
            .bodies = {{"wheel", true, 2, {0, 0, 0.5}}},
            .geoms = {{.body = 0,
                       .kind = GeomKind::kCylinder,
                       .size_m = {0.3, 0.1, 0},
                       .colour = {1, 0, 0, 1}},
                      {.body = {}, .kind = GeomKind::kPlane}},
            .joints = {{0, {0, 1, 0}, {0, 0, 0.25}}, {0, {1, 0, 0}, {}}}};
  }
  std::optional<std::array<double, 2>> stops(std::size_t joint) const override {
    if (joint > 0) return {};
    return std::array{-std::numbers::pi / 2, std::numbers::pi / 4};
  }
  std::vector<BodyPose> poses() const override {
    return {{{1.5, 0, -1e-3 * steps_}, {1, 0, 0, 0}}};
  }
  std::vector<BodyContact> contacts() const override {
    if (steps_ < 2) return {};
    return {{{1.5, 0, 0}, {0, 0, 19.62}}};
  }

 private:
  std::vector<std::string> names_{"axle", "spoke"};
  std::vector<std::string> parts_{"", "wheel"};
  int steps_ = 0;
};

BusConfig on_a_wheel() {
  BusConfig bus = test::bus_config({7}, 1'000'000);
  bus.interface = "vcan0";
  bus.body = std::make_shared<Wheel>();
  BodyState beginning;
  bus.body->read_state(beginning);
  bus.body_signals = std::make_shared<BodySignals>(bus.body->parts(), beginning);
  bus.servos.front().joint = JointLink{};
  return bus;
}

class WheelServer : public HttpServer {
 protected:
  WheelServer() : HttpServer(on_a_wheel()) {}
};

TEST(ControlBody, ListsTheDrivesOfItsJoints) {
  TestWorld t(on_a_wheel());
  EXPECT_EQ(t.get("/status").body["body"], true);
  const Json body = t.get("/body").body;
  EXPECT_EQ(body["mass_kg"], 2);
  EXPECT_EQ(
      body["bodies"],
      Json::parse(
          R"([{"name": "wheel", "free": true, "mass_kg": 2.0, "centre_m": [0.0, 0.0, 0.5]}])"));
  EXPECT_EQ(body["geoms"][0]["type"], "cylinder");
  EXPECT_EQ(body["geoms"][0]["size_m"], Json({0.3, 0.1, 0.0}));
  EXPECT_EQ(body["geoms"][1]["body"], nullptr) << "it stands in the world";
  EXPECT_EQ(body["joints"][0]["name"], "axle");
  EXPECT_EQ(body["joints"][0]["bus"], "vcan0");
  EXPECT_EQ(body["joints"][0]["id"], 7);
  EXPECT_EQ(body["joints"][0]["range_deg"], Json({-90.0, 45.0}));
  EXPECT_EQ(body["joints"][1]["range_deg"], nullptr);
  EXPECT_EQ(body["joints"][1]["name"], "spoke");
  EXPECT_EQ(body["joints"][1]["id"], nullptr) << "nobody turns it";
  EXPECT_EQ(body["poses"], Json::parse("[[1.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]]"));
}

TEST(ControlBody, ReportsSignals) {
  TestWorld t(on_a_wheel());
  const Json values = t.get("/body").body["signals"];
  EXPECT_EQ(values["body.wheel.x_m"], 1.5);
  EXPECT_EQ(values["body.wheel.z_m"], 0);
  EXPECT_EQ(values["body.fallen"], 0);
  const Json all = t.get("/signals").body;
  EXPECT_EQ(all.back()["name"], "body.wheel.contact_N");
}

TEST_F(WheelServer, SendsBodySignalsOncePerSample) {
  start();
  const Client stream = open(upgrade("signals=alive,body.wheel.z_m,body.contact_N&rate_Hz=1000"));
  const std::string first = stream.receive_until("}");
  EXPECT_NE(first.find(R"("body":["body.wheel.z_m","body.contact_N"])"), std::string::npos)
      << first;
  EXPECT_EQ(status(ask(post("/clock/advance", R"({"by_s": 0.003})"))), 200);
  std::string told;
  while (told.find("\"time_s\":0.003,") == std::string::npos) told = stream.receive_until("}");
  EXPECT_NE(told.find(R"("rows":[[7,1]],"body":[-0.003,19.62]})"), std::string::npos) << told;
}

TEST(ControlBody, IsNotFoundWithoutJoints) {
  TestWorld t;
  EXPECT_EQ(t.get("/status").body["body"], false);
  const ApiResponse answer = t.get("/body");
  EXPECT_EQ(answer.status, 404);
  EXPECT_EQ(where(answer), "body");
}

const std::string kBodyUpgrade = upgrade_at("/body");

TEST_F(HttpServer, RejectsBodyStreamWithoutBody) {
  start();
  open(kBodyUpgrade, 404);
}

/// Poses come at once and after each advance of time. Each message is complete, with the state of
/// its instant.
TEST_F(WheelServer, SendsPosesAfterEachAdvance) {
  start();
  const Client stream = open(kBodyUpgrade);
  const std::string first = stream.receive_until("]}");
  EXPECT_NE(first.find(R"({"time_s":0,"shape_changes":0,"poses":[[1.5,0,-0,1,0,0,0]],)"
                       R"("joints_deg":[0.0,0.0],"contacts":[]})"),
            std::string::npos)
      << first;
  EXPECT_EQ(status(ask(post("/clock/advance", R"({"by_s": 0.003})"))), 200);
  std::string told;
  while (told.find("\"time_s\":0.003,") == std::string::npos) told = stream.receive_until("]}");
  EXPECT_NE(told.find(R"("poses":[[1.5,0,-0.003,1,0,0,0]],"joints_deg":[0.0,0.0],)"
                      R"("contacts":[[1.5,0,0,0,0,19.62]]})"),
            std::string::npos)
      << told;
}

TEST_F(WheelServer, LimitsPoseStreams) {
  start();
  std::vector<Client> listeners;
  for (int n = 0; n < kMaxBodyStreams; ++n) listeners.push_back(open(kBodyUpgrade));
  open(kBodyUpgrade, 429);
}

}  // namespace control_body_test
}  // namespace lk::emulator
