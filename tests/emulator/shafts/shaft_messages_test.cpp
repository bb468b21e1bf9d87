// Messages byte for byte as in docs/guides/your-simulator.md; invalid ones are refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <string>
#include <variant>

#include "emulator/io/shafts/shaft_body.hpp"

namespace lk::emulator {
namespace shaft_messages_test {

/// Appends a little-endian number.
void put(ShaftBytes& bytes, std::uint64_t value, int size) {
  for (int n = 0; n < size; ++n) bytes.push_back(static_cast<unsigned char>(value >> (8 * n)));
}

ShaftBytes head(std::uint32_t kind, std::uint32_t bytes, std::uint32_t joints, std::uint32_t what,
                std::uint64_t number) {
  ShaftBytes all{'L', 'K', 'S', 'H', 1, 0, 0, 0};
  for (const std::uint32_t word : {kind, bytes, joints, what}) put(all, word, 4);
  put(all, number, 8);
  return all;
}

ShaftBytes states_of_two() {
  ShaftBytes bytes = head(3, 32 + 2 * 32, 2, 0, 7);
  for (const double value : {1.5, -2.0, 0.25, 0.0, 3.0, 0.0, 0.5, -1.0}) {
    put(bytes, std::bit_cast<std::uint64_t>(value), 8);
  }
  return bytes;
}

TEST(ShaftMessages, TorquesHaveTheDocumentedLayout) {
  const lk_shafts_torque torque{1.0, 2.0, 3.0, 4.0, 5.0};
  ShaftBytes expected = head(4, 32 + 40, 1, 3, 812);
  for (const double value : {1.0, 2.0, 3.0, 4.0, 5.0}) {
    put(expected, std::bit_cast<std::uint64_t>(value), 8);
  }
  EXPECT_EQ(torques_message({&torque, 1}, 3, 812), expected);
  // 1.0 is 3FF0000000000000.
  EXPECT_EQ(expected[38], 0xF0);
  EXPECT_EQ(expected[39], 0x3F);
}

TEST(ShaftMessages, OfferNamesItsJoints) {
  const lk_shafts_offer offer{"vcan0:1", 0.5, 0.25};
  const ShaftBytes bytes = offer_message({&offer, 1}, 1'000'000);
  ASSERT_EQ(bytes.size(), 32U + 80U);
  EXPECT_TRUE(std::ranges::equal(std::span(bytes).first(32), head(1, 112, 1, 0, 1'000'000)));
  EXPECT_EQ(std::string(&bytes[32], &bytes[40]), std::string("vcan0:1\0", 8));
  lk_shafts_offer read{};
  lk_shafts_get_offer(&bytes[32], &read);
  EXPECT_EQ(read.armature_kg_m2, 0.5);
  EXPECT_EQ(read.angle_rad, 0.25);
}

TEST(ShaftMessages, EndIsPaddedToEightBytes) {
  const ShaftBytes bytes = end_message("no");
  ASSERT_EQ(bytes.size(), 40U);
  EXPECT_TRUE(std::ranges::equal(std::span(bytes).first(32), head(5, 40, 0, 2, 0)));
  EXPECT_EQ(end_message(std::string(5000, 'x')).size(), 32U + 1000U);
  lk_shafts_head read{};
  EXPECT_EQ(lk_shafts_get_head(bytes.data(), &read), nullptr);
}

TEST(ShaftMessages, ReadStatesInAnyChunks) {
  const ShaftBytes bytes = states_of_two();
  for (std::size_t slice = 1; slice <= bytes.size(); ++slice) {
    ShaftReader reader(2);
    ShaftReader::Message message;
    std::size_t at = 0;
    while (at < bytes.size()) {
      ASSERT_TRUE(std::holds_alternative<ShaftReader::More>(message));
      const std::size_t size = std::min({slice, reader.bytes_missing(), bytes.size() - at});
      message = reader.take(std::span(bytes).subspan(at, size));
      at += size;
    }
    ASSERT_TRUE(std::holds_alternative<ShaftStates>(message)) << slice;
    const auto& states = std::get<ShaftStates>(message);
    EXPECT_EQ(states.head.number, 7U);
    EXPECT_EQ(states.records[0].angle_rad, 1.5);
    EXPECT_EQ(states.records[0].speed_rad_s, -2.0);
    EXPECT_EQ(states.records[0].inertia_kg_m2, 0.25);
    EXPECT_EQ(states.records[1].torque_Nm, -1.0);
    EXPECT_EQ(reader.bytes_missing(), 32U) << "the next one";
  }
}

TEST(ShaftMessages, RejectMalformedMessages) {
  struct Case {
    const char* what;
    ShaftBytes bytes;
    const char* said;
  };
  ShaftBytes other_version = head(3, 96, 2, 0, 0);
  other_version[4] = 2;
  ShaftBytes greeting(32, 'G');
  const Case cases[] = {
      {"another protocol", greeting, "sent a message that does not begin with LKSH"},
      {"another version", other_version, "sent a message that is of another version"},
      {"kind 0", head(0, 32, 2, 0, 0), "sent a message that is of no known kind"},
      {"kind 6", head(6, 32, 2, 0, 0), "sent a message that is of no known kind"},
      {"ours", head(4, 32 + 80, 2, 1, 0), "sent a message of a kind that only lk-emu sends"},
      {"a joint less", head(3, 64, 1, 0, 0), "sent a message of 1 joints where there are 2"},
      {"short", head(3, 95, 2, 0, 0), "sent a message that has another length than its records"},
      // 2^27 joints of 32 bytes are 2^32 bytes, which is 0 in 32 bits.
      {"overflow", head(3, 32, 1U << 27U, 0, 0),
       "sent a message that has another length than its records"},
      {"text", head(5, 32, 0, UINT32_MAX, 0),
       "sent a message that has another length than its records"},
  };
  for (const Case& one : cases) {
    ShaftReader reader(2);
    const auto message = reader.take(one.bytes);
    ASSERT_TRUE(std::holds_alternative<std::string>(message)) << one.what;
    EXPECT_EQ(std::get<std::string>(message), one.said) << one.what;
  }
}

}  // namespace shaft_messages_test
}  // namespace lk::emulator
