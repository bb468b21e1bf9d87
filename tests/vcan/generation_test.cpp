// Generations, power and protections through the real program: what a host sees, restarts between
// the steps.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <utility>

#include "tests/support/temp_directory.hpp"
#include "tests/vcan/emulator_process.hpp"
#include "tests/vcan/host.hpp"

namespace lk::vcan {
namespace generation_test {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// A configuration file and a ROM directory of its own.
class Configured : public testing::Test {
 protected:
  /// Arguments of a run of one drive on vcan0, ID 1, with `keys` of [[bus.drive]] and after it.
  std::vector<std::string> run_of(const std::string& keys) {
    std::ofstream(directory_ + "/robot.toml") << "[[bus]]\ninterface = \"vcan0\"\n"
                                                 "[[bus.drive]]\nid = 1\n"
                                              << keys;
    return {"--config", directory_ + "/robot.toml", "--rom", directory_ + "/rom"};
  }

  const test::TempDirectory own_;
  const std::string directory_ = own_.path().string();
};

/// Asks until the reply is `wanted`; unanswered queries are asked again.
bool becomes(Host& host, const Payload& query, const Payload& wanted) {
  const auto deadline = Clock::now() + std::chrono::milliseconds(kPatience_ms);
  while (Clock::now() < deadline) {
    host.send(0x141, query);
    const auto reply = host.receive(20);
    Payload data{};
    if (reply) std::copy_n(reply->data, data.size(), data.begin());
    if (reply && data == wanted) return true;
  }
  return false;
}

unsigned uint16_at(const Payload& data, std::size_t at) { return data[at] + 256U * data[at + 1]; }

/// The int16 at `at` of state 2 once it is at least `value`, or what it was when patience ended.
int rises_to(Host& host, std::size_t at, int value) {
  const auto deadline = Clock::now() + std::chrono::milliseconds(kPatience_ms);
  int now = 0;
  while (now < value && Clock::now() < deadline) {
    const auto telemetry = host.query(1, {0x9C});
    if (!telemetry) {
      ADD_FAILURE() << "state 2 is not answered";
      break;
    }
    now = static_cast<std::int16_t>(uint16_at(*telemetry, at));
  }
  return now;
}

TEST_F(Configured, TheSameQueryIsAnsweredInTheWayOfEachGeneration) {
  const struct {
    const char* generation;
    std::size_t voltage_at;
    double lsb_V;
    bool gains;
  } kinds[] = {{"legacy", 3, 0.1, true},
               {"late-legacy", 3, 0.1, true},
               {"v235", 2, 0.01, false},
               {"v236", 2, 0.01, false}};
  for (const auto& kind : kinds) {
    SCOPED_TRACE(kind.generation);
    EmulatorProcess emulator(run_of(std::string("generation = \"") + kind.generation + "\"\n"));
    ASSERT_TRUE(emulator.wait_ready());
    Host host("vcan0");
    const auto state = host.query(1, {0x9A});
    ASSERT_TRUE(state);
    EXPECT_NEAR(uint16_at(*state, kind.voltage_at) * kind.lsb_V, 24.0, 0.5);
    host.send(0x141, {0x30});
    host.send(0x141, {0x9C});
    const auto first = host.receive();
    ASSERT_TRUE(first);
    EXPECT_EQ(first->data[0], kind.gains ? 0x30 : 0x9C);
    EXPECT_EQ(emulator.stop().status, 0);
  }
}

// What a host written for an MG4010 makes of it: 0x94 as uint32 at 4–7, 0.01° of the rotor; ±2048
// is ±33 A.
TEST(Asked, AnMg4010SpeaksAsSuchDrivesWereSeenTo) {
  const auto single_turn_deg = [](Host& host) {
    const Payload data = host.query(1, {0x94}).value_or(Payload{});
    return (uint16_at(data, 4) + 65536.0 * uint16_at(data, 6)) / 100;
  };
  const auto encoder_deg =
      [](Host& host) {  // the field spans a turn of the output, ten of the rotor
        return uint16_at(host.query(1, {0x90}).value_or(Payload{}), 2) * 3600.0 / 65536;
      };
  const std::vector<std::string> plain = {"--bus",   "vcan0",  "--ids", "1",
                                          "--motor", "mg4010", "--rom", ":memory:"};
  const std::string note =
      "mg4010: such drives were seen to speak late-legacy, this one speaks legacy (--generation "
      "seen changes that)\n";
  {
    EmulatorProcess emulator(plain);
    ASSERT_TRUE(emulator.wait_ready());
    Host host("vcan0");
    EXPECT_GT(single_turn_deg(host), 3600);
    const auto result = emulator.stop();
    EXPECT_NE(result.err.find(note), std::string::npos) << result.err;
  }
  auto asked = plain;
  asked.insert(asked.end(), {"--generation", "legacy"});
  {
    EmulatorProcess emulator(asked);
    ASSERT_TRUE(emulator.wait_ready());
    const auto result = emulator.stop();
    EXPECT_EQ(result.err.find("were seen to speak"), std::string::npos) << result.err;
  }
  asked.back() = "seen";
  EmulatorProcess emulator(asked);
  ASSERT_TRUE(emulator.wait_ready());
  Host host("vcan0");
  EXPECT_LT(single_turn_deg(host), 3600);
  EXPECT_NEAR(single_turn_deg(host), encoder_deg(host), 2 * 3600.0 / 65536);
  const auto state = host.query(1, {0x9A});
  ASSERT_TRUE(state);
  EXPECT_NEAR(uint16_at(*state, 3) * 0.1, 24.0, 0.5);
  EXPECT_EQ(host.query(1, {0x9B}).value_or(Payload{})[0], 0x9B);
  const auto result = emulator.stop();
  EXPECT_EQ(result.err.find("were seen to speak"), std::string::npos) << result.err;
}

TEST_F(Configured, AParameterOfV236IsGoneAfterTheRestart) {
  const auto arguments = run_of("generation = \"v236\"\n");
  const Payload write = {0xC1, 0x0A, 0x2C, 0x01, 30, 0, 7, 0};  // angle Kp 300, Ki 30, Kd 7
  Payload before{};
  {
    EmulatorProcess emulator(arguments);
    ASSERT_TRUE(emulator.wait_ready());
    Host host("vcan0");
    before = host.query(1, {0xC0, 0x0A}).value_or(Payload{});
    EXPECT_EQ(host.query(1, write), write);
    Payload expected = write;
    expected[0] = 0xC0;
    EXPECT_EQ(host.query(1, {0xC0, 0x0A}), expected);
    emulator.stop();
  }
  EmulatorProcess emulator(arguments);
  ASSERT_TRUE(emulator.wait_ready());
  Host host("vcan0");
  EXPECT_EQ(host.query(1, {0xC0, 0x0A}), before);
}

// The classic way to lose a motor, and how it is found again.
TEST_F(Configured, AnIdWrittenOverTheBusIsWhereTheDriveIsUntilRomIsWiped) {
  auto arguments = run_of("generation = \"v236b\"\n");
  const auto holder = [&] {
    return EmulatorProcess(
               {"--bus", "vcan0", "--ids", "9", "--rom", ":memory:", "--control", "none"})
        .wait();
  };
  {
    EmulatorProcess emulator(arguments);
    ASSERT_TRUE(emulator.wait_ready());
    Host host("vcan0");
    const Payload id_9 = {0x42, 0x05, 0x0A, 0, 9};
    EXPECT_EQ(host.query(1, id_9), id_9);
    EXPECT_EQ(host.query(1, {0x44, 0x05, 0xFA}), (Payload{0x44, 0x05, 0x01}));
    host.send(0x141, Payload{0x07});
    ASSERT_TRUE(emulator.wait_for_log("drive 1 answers at ID 9"));
    host.send(0x141, Payload{0x88});  // silence: the next frame is the reply to the next query
    EXPECT_EQ(host.query(9, {0x88}), Payload{0x88});
    EXPECT_NE(holder().err.find("vcan0: ID 9 is answered by lk-emu"), std::string::npos);
    // The ID that it has left is free.
    EmulatorProcess beside(
        {"--bus", "vcan0", "--ids", "1", "--rom", ":memory:", "--control", "none"});
    EXPECT_TRUE(beside.wait_ready());
  }
  {
    auto check = arguments;
    check.emplace_back("--check");
    const auto checked = EmulatorProcess(check).wait();
    EXPECT_EQ(checked.status, 0);
    EXPECT_NE(checked.out.find("drive 1: answers at ID 9"), std::string::npos) << checked.out;
    EmulatorProcess emulator(arguments);
    ASSERT_TRUE(emulator.wait_ready());
    Host host("vcan0");
    EXPECT_EQ(host.query(9, {0x88}), Payload{0x88});
    const auto result = emulator.stop();
    EXPECT_NE(result.out.find("lk-emu ready vcan0:1 (1 answers at ID 9)"), std::string::npos)
        << result.out;
    EXPECT_NE(result.err.find("drive 1 answers at ID 9"), std::string::npos) << result.err;
  }
  arguments.emplace_back("--wipe-rom");
  EmulatorProcess emulator(arguments);
  ASSERT_TRUE(emulator.wait_ready());
  Host host("vcan0");
  EXPECT_EQ(host.query(1, {0x88}), Payload{0x88});
}

TEST_F(Configured, AnAngleSetWith95IsGoneAfterTheRestart) {
  const auto arguments = run_of("generation = \"v236\"\nboot_angle_deg = 30\n");
  for (int start = 0; start < 2; ++start) {
    EmulatorProcess emulator(arguments);
    ASSERT_TRUE(emulator.wait_ready());
    Host host("vcan0");
    const auto before = host.query(1, {0x92});
    ASSERT_TRUE(before);
    EXPECT_NEAR(uint16_at(*before, 1), 3000, 50);  // the encoder is not perfect: inl_1, inl_2
    ASSERT_TRUE(host.query(1, {0x95, 0, 0, 0, 0x10, 0x27}));  // 100.00 degrees
    EXPECT_NEAR(uint16_at(*host.query(1, {0x92}), 1), 10000, 10);
    emulator.stop();
  }
}

TEST_F(Configured, TheBrakeHoldsUntilItIsReleased) {
  EmulatorProcess emulator(
      run_of("generation = \"v236\"\n"
             "profile.brake = { tau_mNm = 5000, engage_ms = 5, release_ms = 5 }\n"));
  ASSERT_TRUE(emulator.wait_ready());
  Host host("vcan0");
  EXPECT_EQ(host.query(1, {0x8C, 0x10}), (Payload{0x8C, 0}));  // engaged from power-up
  const Payload turn = {0xA2, 0, 0, 0, 0xA0, 0x8C, 0, 0};
  ASSERT_TRUE(host.query(1, turn));
  for (int n = 0; n < 100; ++n) {
    EXPECT_NEAR(static_cast<std::int16_t>(uint16_at(*host.query(1, {0x9C}), 4)), 0, 20);
  }
  EXPECT_EQ(host.query(1, {0x8C, 1}), (Payload{0x8C, 1}));
  const int speed_dps = rises_to(host, 4, 300);
  EXPECT_GE(speed_dps, 300);
}

TEST_F(Configured, SeveralDrivesAnswerOneFrameOnTheIdentifiersOfTheirReplies) {
  std::ofstream(directory_ + "/robot.toml")
      << "[[bus]]\ninterface = \"vcan0\"\n[[bus.drive]]\nids = \"1-3\"\ngeneration = \"v236\"\n"
         "settings.broadcast_mode = true\nquirks.reply_id_base = 0x180\n";
  EmulatorProcess emulator({"--config", directory_ + "/robot.toml", "--rom", ":memory:"});
  ASSERT_TRUE(emulator.wait_ready());
  Host host("vcan0");
  host.send(0x141, {0x9C});                             // single-drive frames are not for them
  host.send(0x281, {0x64, 0, 0, 0, 0x9C, 0xFF, 0, 0});  // 100, 0, −100 dps
  for (canid_t id = 1; id <= 3; ++id) {
    const auto reply = host.receive();
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->can_id, 0x180 + id);
    EXPECT_EQ(reply->data[0], 0xA2);
  }
  host.send(0x288, {0x9A, 0, 0, 0, 0x92, 0, 0, 0});
  for (const auto& [id, command] : {std::pair<canid_t, int>{0x181, 0x9A}, {0x183, 0x92}}) {
    const auto reply = host.receive();
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->can_id, id);
    EXPECT_EQ(reply->data[0], command);
  }
}

TEST_F(Configured, ASagBelowResetKillsTheDriveUntilTheVoltageIsBack) {
  EmulatorProcess emulator(
      run_of("[[bus.event]]\nat_s = 0.3\nsupply_V = 2\n"
             "[[bus.event]]\nat_s = 0.8\nsupply_V = 24\n"));
  ASSERT_TRUE(emulator.wait_ready());
  Host host("vcan0");
  const Payload acceleration = {0x34, 0, 0, 0, 0x68, 1, 0, 0};
  EXPECT_EQ(host.query(1, acceleration), acceleration);
  EXPECT_TRUE(becomes(host, {0x33}, {0x33}));  // RAM is gone
  const auto result = emulator.stop();
  EXPECT_NE(result.out.find("drive without power"), std::string::npos) << result.out;
}

TEST_F(Configured, LostInputLatchesAndTakesClearAndRun) {
  EmulatorProcess emulator(
      run_of("quirks.all_error_bits = true\n"
             "settings.protection.lost_input = { enabled = true, threshold_s = 0.2 }\n"));
  ASSERT_TRUE(emulator.wait_ready());
  Host host("vcan0");
  const Payload turn = {0xA2, 0, 0, 0, 0xA0, 0x8C, 0, 0};
  ASSERT_TRUE(host.query(1, turn));
  // Silence is the stimulus: there is nothing to wait for but time.
  EXPECT_FALSE(host.receive(400));
  const auto state = host.query(1, {0x9A});
  ASSERT_TRUE(state);
  EXPECT_EQ((*state)[7], 0x80);
  EXPECT_TRUE(host.query(1, turn));  // answered, ignored
  EXPECT_EQ((*host.query(1, {0x9A}))[7], 0x80);
  EXPECT_EQ((*host.query(1, {0x9B}))[7], 0);
  EXPECT_EQ(host.query(1, {0x88}), (Payload{0x88}));
  EXPECT_TRUE(host.query(1, turn));
  const int speed_dps = rises_to(host, 4, 300);
  EXPECT_GE(speed_dps, 300);
}

TEST_F(Configured, MsDrivesHaveOpenLoopAndNoTorque) {
  EmulatorProcess emulator(run_of("motor = \"ms3506\"\ngeneration = \"v235\"\n"));
  ASSERT_TRUE(emulator.wait_ready());
  Host host("vcan0");
  for (const std::uint8_t unsupported : {std::uint8_t{0xA1}, std::uint8_t{0x9D}}) {
    host.send(0x141, {unsupported});
    EXPECT_EQ(host.query(1, {0x9C}).value_or(Payload{})[0], 0x9C);  // the first to be answered
  }
  ASSERT_TRUE(host.query(1, {0xA0, 0, 0, 0, 0xF4, 0x01}));  // 500 of 1000
  const int power = rises_to(host, 2, 490);
  EXPECT_NEAR(power, 500, 10);
}

TEST_F(Configured, TheFourDeliveredRobotsAnswer) {
  const fs::path robots = fs::path(LKEMU_SOURCE_DIR) / "configs/buses";
  for (const char* robot : {"gimbal", "turntable", "bench"}) {
    SCOPED_TRACE(robot);
    EmulatorProcess emulator({"--config", (robots / robot).replace_extension("toml"), "--bus",
                              "vcan0", "--rom", directory_ + "/rom"});
    ASSERT_TRUE(emulator.wait_ready());
    Host host("vcan0");
    EXPECT_EQ(host.query(1, {0x9C}).value_or(Payload{})[0], 0x9C);
    EXPECT_EQ(emulator.stop().status, 0);
  }
  EmulatorProcess emulator({"--config", robots / "quadruped.toml", "--rom", directory_ + "/rom"});
  ASSERT_TRUE(emulator.wait_ready());
  Host front("vcan0");
  Host hind("vcan1");
  for (int id = 1; id <= 6; ++id) EXPECT_TRUE(front.query(id, {0x92})) << id;
  for (int id = 7; id <= 12; ++id) EXPECT_TRUE(hind.query(id, {0x92})) << id;
}

}  // namespace generation_test
}  // namespace lk::vcan
