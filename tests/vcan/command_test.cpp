// Every command of the protocol through a kernel socket, against the real program.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "protocol/codec.hpp"
#include "tests/vcan/emulator_process.hpp"
#include "tests/vcan/host.hpp"

namespace lk::vcan {
namespace command_test {

std::int16_t int16_at(const Payload& data, std::size_t at) {
  return static_cast<std::int16_t>(data[at] | (data[at + 1] << 8));
}

/// Signed 56-bit angle of a 0x92 reply, 0.01°.
std::int64_t multi_turn_angle(const Payload& reply) {
  std::uint64_t raw = 0;
  for (std::size_t i = 7; i >= 1; --i) raw = raw << 8 | reply[i];
  return static_cast<std::int64_t>(raw << 8) >> 8;
}

class Command : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    emulator_ = new EmulatorProcess({"--rom", ":memory:", "--bus", "vcan0", "--ids", "1-4"});
    ASSERT_TRUE(emulator_->wait_ready());
  }
  static void TearDownTestSuite() {
    const auto result = emulator_->stop();
    EXPECT_EQ(result.status, 0) << result.err;
    delete emulator_;
  }

  /// Asks until `good(reply)`; false when patience ends first.
  template <typename Good>
  bool eventually(int id, const Payload& query, Good good) {
    const auto deadline =
        std::chrono::steady_clock::now() + std::chrono::milliseconds(kPatience_ms);
    while (std::chrono::steady_clock::now() < deadline) {
      const auto reply = host_.query(id, query);
      if (!reply) return false;
      if (good(*reply)) return true;
    }
    return false;
  }

  static EmulatorProcess* emulator_;
  Host host_{"vcan0"};
};
EmulatorProcess* Command::emulator_ = nullptr;

/// docs/protocol.md §3, by hand.
bool is_echo(std::uint8_t byte) {
  constexpr std::uint8_t kEchoes[] = {0x31, 0x32, 0x34, 0x80, 0x81, 0x88, 0x91, 0x95};
  return std::ranges::find(kEchoes, byte) != std::end(kEchoes);
}

TEST_F(Command, EveryOneOfTheTableIsAnsweredOnceOnItsOwnIdentifier) {
  int answered = 0;
  for (const auto& row : protocol::commands()) {
    if (!protocol::answers(protocol::kLegacyFormat, row.opcode)) continue;
    ++answered;
    const Payload query = {static_cast<std::uint8_t>(row.opcode)};
    const auto reply = host_.query(4, query);
    ASSERT_TRUE(reply) << row.name;
    EXPECT_EQ((*reply)[0], query[0]) << row.name;
    if (is_echo(query[0])) {
      EXPECT_EQ(*reply, query) << row.name;
    }
  }
  EXPECT_EQ(answered, 28);
}

TEST_F(Command, OthersAreNotAnswered) {
  std::size_t unknown = 0;
  for (unsigned byte = 0; byte < 256; ++byte) {
    const auto* row = protocol::find_command(static_cast<std::uint8_t>(byte));
    if (row != nullptr && protocol::answers(protocol::kLegacyFormat, row->opcode)) continue;
    host_.send(0x144, {static_cast<std::uint8_t>(byte)});
    ++unknown;
  }
  EXPECT_EQ(unknown, 228U);
  // Had one of them been answered, that reply would come before this one.
  const auto reply = host_.query(4, {0x9A});
  ASSERT_TRUE(reply);
  EXPECT_EQ((*reply)[0], 0x9A);
}

TEST_F(Command, GainsAreKept) {
  const Payload gains = {0x31, 0, 11, 22, 33, 44, 55, 66};
  EXPECT_EQ(host_.query(3, gains), gains);
  EXPECT_EQ(host_.query(3, {0x30}), (Payload{0x30, 0, 11, 22, 33, 44, 55, 66}));
}

TEST_F(Command, StateOneShowsTheSupplyAndNoError) {
  const auto reply = host_.query(1, {0x9A});
  ASSERT_TRUE(reply);
  EXPECT_NEAR(int16_at(*reply, 3), 240, 5);
  EXPECT_EQ((*reply)[7], 0);
}

TEST_F(Command, ASpeedCommandTurnsTheMotor) {
  ASSERT_TRUE(host_.query(1, {0xA2, 0, 0, 0, 0xA0, 0x8C, 0, 0}));  // 360.00 dps
  EXPECT_TRUE(eventually(
      1, {0x9C}, [](const Payload& state) { return std::abs(int16_at(state, 4) - 360) <= 10; }));
  ASSERT_TRUE(host_.query(1, {0x81}));
  EXPECT_TRUE(eventually(1, {0x9C}, [](const Payload& state) { return int16_at(state, 4) == 0; }));
}

TEST_F(Command, APositionCommandArrives) {
  constexpr std::int64_t kTarget = -7200;  // 0.01°
  ASSERT_TRUE(host_.query(2, {0xA4, 0, 0x68, 0x01, 0xE0, 0xE3, 0xFF, 0xFF}));
  EXPECT_TRUE(eventually(2, {0x92}, [](const Payload& reply) {
    return std::abs(multi_turn_angle(reply) - kTarget) <= 5;
  }));
}

TEST_F(Command, BurstsAreAnsweredInOrderAndOnce) {
  for (std::uint8_t i = 0; i < 4; ++i) host_.send(0x141U + i, {0x9A});
  for (canid_t i = 0; i < 4; ++i) {
    const auto reply = host_.receive();
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->can_id, 0x141 + i);
  }
}

TEST_F(Command, TwoHostsSeeEachOthersQueriesAndAllReplies) {
  Host other("vcan0");
  host_.send(0x141, {0x9A});
  const auto query = other.receive();
  ASSERT_TRUE(query);
  EXPECT_EQ(query->can_id, 0x141U);
  EXPECT_EQ(query->data[3], 0) << "the query";
  const auto reply = other.receive();
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->can_id, 0x141U);
  EXPECT_NE(reply->data[3], 0) << "the reply, with the voltage";
  EXPECT_TRUE(host_.receive());
  // And the other way round.
  EXPECT_TRUE(other.query(2, {0x9C}));
}

}  // namespace command_test
}  // namespace lk::vcan
