// Scenarios that clients start on running buses.

#include "emulator/io/program/scenario_activity.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "tests/emulator/control/control_support.hpp"
#include "tests/emulator/coupling/hand_bodies.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::emulator {
namespace scenario_activity_test {

using namespace std::chrono_literals;

/// A test world whose clients can start scenarios.
struct ScenarioWorld : TestWorld {
  ScenarioActivity activity{loop, world};
  ScenarioWorld() { api.scenario = activity.for_clients(); }
};

/// A run of this many seconds whose drive has to stay on.
std::string running_for(const char* seconds) {
  return std::string("duration_s = ") + seconds + "\n[[expect]]\nid = 1\nstate = \"running\"\n";
}

/// Reading a long one would block the drives.
TEST(ScenarioActivity, LimitsScenariosOfClients) {
  ScenarioWorld t;
  const test::TempDirectory own;
  const std::string text = "robot = \"x\"\n" + running_for("1");
  const auto post = [&](std::size_t size) {
    const std::string file = own.put("long.toml", text + std::string(size - text.size(), '\n'));
    return t.post("/scenario", Json{{"file", file}}.dump());
  };
  EXPECT_EQ(where(post(ScenarioActivity::kLongestFile + 1)), "file");
  EXPECT_EQ(post(ScenarioActivity::kLongestFile).status, 200);
}

/// Each line of a scenario may name a log, which is read again each time.
TEST(ScenarioActivity, LimitsTotalLogSizeOfClients) {
  ScenarioWorld t;
  const test::TempDirectory own;
  std::string text = running_for("1");
  // A third of the limit, most of it empty lines.
  const std::string line = "(1.0) vcan0 141#9C00000000000000\n";
  const std::size_t third = ScenarioActivity::kLongestFile / 3;
  const std::string log = own.put("p.log", line + std::string(third - line.size(), '\n'));
  const std::string play = "[[send]]\nplay = \"" + log + "\"\n";
  for (int n = 0; n < 3; ++n) text += play;
  const auto post = [&] { return t.post("/scenario", Json{{"toml", text}}.dump()); };
  EXPECT_EQ(post().status, 200);
  EXPECT_EQ(t.send("DELETE", "/scenario", "").status, 200);
  text += play;
  EXPECT_EQ(where(post()), "send.play");
  const std::string most = std::to_string(ScenarioActivity::kLongestFile);
  EXPECT_NE(reason(post()).find("the logs to play are longer than " + most + " bytes in all"),
            std::string::npos)
      << reason(post());
}

TEST(ScenarioActivity, ReportsTheIntendedRobot) {
  ScenarioWorld t;
  const test::TempDirectory own;
  own.put("arm.toml",
          "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nid = 1\nmotor = \"" LKEMU_SOURCE_DIR
          "/configs/motors/mg8016.toml\"\n");
  const std::string file = own.put("lift.toml", "robot = \"./arm.toml\"\n" + running_for("1"));
  ASSERT_EQ(t.post("/scenario", Json{{"file", file}}.dump()).status, 200);
  const Json report = t.get("/scenario").body;
  EXPECT_EQ(report["robot"], "./arm.toml");
  ASSERT_EQ(report["foreign"].size(), 1U) << report.dump();
  EXPECT_EQ(report["foreign"][0]["id"], 1);
  EXPECT_EQ(report["foreign"][0]["meant"], "mg8016.toml");
  EXPECT_EQ(report["foreign"][0]["running"], t.world.lines()[0]->config().servos[0].profile.name);
}

/// A client of the TCP port need not be the owner of these files.
TEST(ScenarioActivity, HidesFilesFromTcpClientsExceptShippedOnes) {
  ScenarioWorld t;
  const test::TempDirectory own;
  const std::string there = own.put("secret", "\x1bsecret");
  const auto over_tcp = [&](const Json& body) {
    ApiRequest request{"POST", "/api/v1/scenario", {}, "application/json", body.dump()};
    request.same_user = false;
    return t.ask(request);
  };
  const auto said = [](ApiResponse response, const std::string& file) {
    std::string why = reason(response);
    if (const auto at = why.find(file); at != std::string::npos)
      why.replace(at, file.size(), "FILE");
    return std::to_string(response.status) + " " + why;
  };
  const std::string missing = own.path("missing");
  const auto asked_for = [&](const std::string& file) { return over_tcp(Json{{"file", file}}); };
  EXPECT_EQ(asked_for(there).status, 403);
  EXPECT_EQ(said(asked_for(there), there), said(asked_for(missing), missing));
  const std::string checks = running_for("1");
  const auto playing = [&](const std::string& file) {
    return said(over_tcp(Json{{"toml", checks + "[[send]]\nplay = \"" + file + "\"\n"}}), file);
  };
  EXPECT_EQ(playing(there), playing(missing));
  EXPECT_EQ(over_tcp(Json{{"toml", checks}}).status, 200);
}

/// A free wheel that bursts.
class Bursting : public test::HandBody {
 public:
  Bursting()
      : HandBody(
            1,
            [](const auto&, const auto&) {
              return test::Dynamics{{1, 0}, 0, {}, 0};
            },
            1ms) {}
  std::unique_ptr<Mechanism> clone() const override { return std::make_unique<Bursting>(*this); }
  void advance(std::span<const JointTorque> /*torques*/) override { ++steps_; }
  std::optional<std::string> failure() const override {
    return steps_ < 300 ? std::nullopt : std::optional<std::string>("it has burst");
  }

 private:
  int steps_ = 0;
};

/// All expectations hold, because the drive notices nothing.
TEST(ScenarioActivity, BodyFailureMakesTheVerdictInvalid) {
  ScenarioWorld t;
  t.world.couple(std::make_unique<Bursting>(), {});
  const auto run = [&] {
    EXPECT_EQ(t.post("/scenario", Json{{"toml", running_for("0.2")}}.dump()).status, 200);
    EXPECT_EQ(t.post("/clock/advance", R"({"by_s": 0.2})").status, 200);
    t.loop.restart();
    t.loop.poll();
    return t.get("/scenario").body;
  };
  EXPECT_EQ(run()["state"], "passed");
  const Json second = run();
  EXPECT_EQ(second["state"], "invalid");
  EXPECT_EQ(second["invalid"], Json({"the body at 0.3 s: it has burst"}));
}

TEST(ScenarioActivity, RejectedScenarioKeepsTheLastVerdict) {
  ScenarioWorld t;
  const auto with = [](int faults) {
    std::string text = running_for("1");
    for (int n = 0; n < faults; ++n) text += "[[event]]\nat_s=1\nid=1\nfault=\"hang\"\n";
    return Json{{"toml", text}}.dump();
  };
  const auto most = static_cast<int>(Bus::kMaxFaults);
  ASSERT_EQ(t.post("/directives", R"({"id": 1, "fault": "hang"})").status, 200);
  ASSERT_EQ(t.post("/scenario", with(0)).status, 200);
  ASSERT_EQ(t.send("DELETE", "/scenario", "").status, 200);
  const ApiResponse refused = t.post("/scenario", with(most));
  EXPECT_EQ(refused.status, 409) << reason(refused);
  EXPECT_EQ(t.get("/scenario").status, 200);
}

}  // namespace scenario_activity_test
}  // namespace lk::emulator
