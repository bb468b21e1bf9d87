// JSON of a drive in the control interface.

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "tests/emulator/control/control_support.hpp"

namespace lk::emulator {
namespace control_json_test {

TEST(ControlJson, ReportsSurroundingsOfADrive) {
  TestWorld t;
  const auto now = [&](const char* id) {
    return t.get(std::string("/drives/vcan0/") + id).body["surroundings"];
  };
  EXPECT_EQ(now("1")["power"], "on");
  const Json before = now("2");
  t.post("/directives", R"({"id": 1, "supply_V": 20, "ramp_s": 1})");
  t.post("/directives", R"({"id": 1, "ambient_C": 40})");
  t.post("/directives", R"({"id": 1, "load": {"J_g_cm2": 12, "theta_max_deg": 90}})");
  t.post("/clock/advance", R"({"by_s": 0.5})");
  EXPECT_NEAR(now("1")["supply_V"].get<double>(), (24 + 20) / 2.0, 0.01) << "half of the ramp";
  EXPECT_NEAR(now("1")["ambient_C"].get<double>(), 40, 1e-9);
  EXPECT_NEAR(now("1")["load"]["J_g_cm2"].get<double>(), 12, 1e-9);
  EXPECT_NEAR(now("1")["load"]["theta_max_deg"].get<double>(), 90, 1e-9);
  t.post("/directives", R"({"id": 1, "power": "off"})");
  EXPECT_EQ(now("1")["power"], "off");
  EXPECT_EQ(now("2"), before);
}

/// A fault may keep a drive's reply off the wire.
TEST(ControlJson, CountsFramesSentByADrive) {
  TestWorld t;
  ASSERT_EQ(t.post("/directives", R"({"id": 2, "fault": "silent"})").status, 200);
  Line& line = *t.world.lines()[0];
  line.accept({SimTime{0}, test::frame("141#9A00000000000000")});
  line.accept({SimTime{0}, test::frame("142#9A00000000000000")});
  line.advance_to(std::chrono::milliseconds(2), MonoTime::max(), Line::WaitPolicy::kNone);
  const Json drives = t.get("/drives").body;
  EXPECT_EQ(drives[0]["counters"]["replies"], 1);
  EXPECT_EQ(drives[0]["counters"]["sent"], 1);
  EXPECT_EQ(drives[1]["counters"]["replies"], 1);
  EXPECT_EQ(drives[1]["counters"]["sent"], 0);
}

TEST(ControlJson, ReportsSetPointsOfTheLoops) {
  TestWorld t;
  const auto said = [&](const protocol::Payload& data) {
    protocol::Frame frame;
    frame.id = 0x141;
    frame.dlc = 8;
    frame.data = data;
    t.world.lines().front()->accept({SimTime{0}, frame});
    t.post("/clock/advance", R"({"by_s": 0.01})");
    return t.get("/drives/vcan0/1").body["setpoint"];
  };
  // docs/reference/protocol.md: 0.01 degrees a bit. One of 65536 encoder counts is 0.0055 degrees.
  const Json position = said({0xA3, 0, 0, 0, 0x10, 0x27, 0, 0});
  EXPECT_NEAR(position.at("angle_deg").get<double>(), 100, 0.011);
  const Json speed = said({0xA2, 0, 0, 0, 0x10, 0x27, 0, 0});
  EXPECT_NEAR(speed.at("speed_dps").get<double>(), 100, 1e-6);
  EXPECT_EQ(speed.size(), 1U);
  EXPECT_TRUE(said({0x80, 0, 0, 0, 0, 0, 0, 0}).is_null());
  EXPECT_TRUE(t.get("/drives/vcan0/2").body["setpoint"].is_null());
}

}  // namespace control_json_test
}  // namespace lk::emulator
