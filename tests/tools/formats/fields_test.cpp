// The table of fields agrees with the codec, bit for bit.

#include "tools/formats/fields.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <span>

#include "protocol/field_values.hpp"
#include "tests/tools/formats/codec_values.hpp"

namespace lk::formats {
namespace fields_test {

using protocol::CommandInfo;
using protocol::Frame;
using protocol::Opcode;
using protocol::Payload;
using protocol::Series;
using protocol::WireFormat;
using test::Values;

std::vector<WireFormat> all_formats() {
  std::vector<WireFormat> formats;
  for (const auto& generation : protocol::kGenerationRows) {
    for (const Series series : {Series::kMs, Series::kMf, Series::kMg, Series::kMh}) {
      formats.push_back(protocol::wire_format(generation.dialect, series));
    }
  }
  return formats;
}

/// Extracts a field bit by bit, without code of the codec.
std::int64_t raw(const Field& field, const Payload& data) {
  std::int64_t number = 0;
  for (unsigned k = 0; k < field.bits; ++k) {
    const unsigned bit = field.first_bit + k;
    const std::int64_t weight = std::int64_t{1} << k;
    if ((unsigned{data[bit / 8]} >> (bit % 8) & 1U) == 0) continue;
    number += field.is_signed && k + 1 == field.bits ? -weight : weight;
  }
  return number;
}

/// Returns whether the selector has the field's value; selectors may have selectors themselves.
bool present(const std::vector<Field>& fields, const Field& field, const Payload& data) {
  if (field.selector.empty()) return true;
  const auto selector = std::ranges::find(fields, field.selector, &Field::name);
  return selector != fields.end() && raw(*selector, data) == field.only_at &&
         present(fields, *selector, data);
}

enum class Clamp : std::uint8_t { kNo, kYes };

Values table_values(const std::vector<Field>& fields, const Payload& data, Clamp clamp) {
  Values values;
  for (const Field& field : fields) {
    if (!present(fields, field, data)) continue;
    auto number = raw(field, data);
    // An invalid setting is refused, not clamped.
    const bool refused = field.name.starts_with("setting_");
    if (clamp == Clamp::kYes && !refused) number = std::clamp(number, field.raw_min, field.raw_max);
    EXPECT_TRUE(values.emplace(field.name, static_cast<double>(number) * field.lsb).second)
        << field.name << " twice";
  }
  return values;
}

void expect_same(const Values& table, const Values& codec) {
  ASSERT_EQ(table.size(), codec.size());
  for (auto one = table.begin(), other = codec.begin(); one != table.end(); ++one, ++other) {
    EXPECT_EQ(one->first, other->first);
    // A product with an LSB may differ from a quotient in the last bit.
    EXPECT_NEAR(one->second, other->second, 4e-16 * std::abs(other->second)) << one->first;
  }
}

/// Random payloads, with valid values in bytes that the codec does not keep completely.
class Payloads {
 public:
  Payload next(Opcode opcode, bool reply, const WireFormat& format) {
    Payload data{};
    for (auto& byte : std::span(data).first(protocol::kCanBytes))
      byte = static_cast<std::uint8_t>(random_() & 0xFFU);
    data[0] = static_cast<std::uint8_t>(opcode);
    if (opcode == protocol::ReadParameter::kOpcode || opcode == protocol::WriteParameter::kOpcode) {
      constexpr std::uint8_t kIds[] = {0x0A, 0x0B, 0x0C, 0x1E, 0x20, 0x22, 0x24, 0x26};
      data[1] = kIds[random_() % std::size(kIds)];
    }
    if (opcode == protocol::ReadStoredSetting::kOpcode ||
        opcode == protocol::WriteStoredSetting::kOpcode) {
      constexpr std::uint8_t kTables[] = {0x05, 0x05, 0x05, 0xA0, 0xA4, 0xA8};
      constexpr std::uint8_t kItems[] = {0x0A, 0x0B, 0x0C, 0x0D, 0xE0, 0xE2, 0xE4, 0xEA, 0xEC};
      data[1] = kTables[random_() % std::size(kTables)];
      if (data[1] == 0x05) data[2] = kItems[random_() % std::size(kItems)];
    }
    if (opcode == protocol::SaveSettings::kOpcode) {
      data[1] = 0x05;
      data[2] = reply ? data[2] & 1U : 0xFA;
    }
    if (reply && opcode == protocol::Brake::kOpcode) data[1] &= 1U;
    const bool state_1 =
        opcode == protocol::ReadState1::kOpcode || opcode == protocol::ClearErrors::kOpcode;
    if (reply && state_1 &&
        format.dialect.state_1 == protocol::State1Layout::kCentiVoltAndBusCurrent) {
      data[6] &= 0x10U;
    }
    return data;
  }

 private:
  std::mt19937 random_{1};
};

constexpr int kTries = 200;

/// Calls check(format, command, payload) for all combinations.
template <class Check>
void for_all(bool reply, Check check) {
  Payloads payloads;
  for (const WireFormat& format : all_formats()) {
    for (const CommandInfo& command : protocol::commands()) {
      if (!protocol::knows(format, command)) continue;
      SCOPED_TRACE(testing::Message()
                   << command.name << " series " << static_cast<int>(format.series));
      for (int n = 0; n < kTries; ++n) {
        check(format, command, payloads.next(command.opcode, reply, format));
      }
      if (testing::Test::HasFailure()) return;
    }
  }
}

TEST(Fields, QueriesDecodeAsTheCodecDoes) {
  for_all(false, [](const WireFormat& format, const CommandInfo& command, const Payload& data) {
    expect_same(table_values(fields_of(command.query, format), data, Clamp::kYes),
                test::query_values(Frame{.id = 0x141, .data = data}, format));
  });
}

TEST(Fields, RepliesDecodeAsTheCodecDoes) {
  for_all(true, [](const WireFormat& format, const CommandInfo& command, const Payload& data) {
    expect_same(table_values(fields_of(command.reply, format), data, Clamp::kNo),
                test::reply_values(Frame{.id = 0x141, .data = data}, format));
  });
}

TEST(Fields, MultiDriveQueriesDecodeAsTheCodecDoes) {
  std::mt19937 random(2);
  int seen = 0;
  for (const WireFormat& format : all_formats()) {
    for (const auto& row : protocol::multi_drive_commands()) {
      if (!protocol::knows(format, row)) continue;
      for (int n = 0; n < kTries; ++n) {
        Frame frame{.id = row.identifier};
        for (auto& byte : std::span(frame.data).first(protocol::kCanBytes))
          byte = static_cast<std::uint8_t>(random() & 0xFFU);
        expect_same(table_values(multi_drive_fields(row, format), frame.data, Clamp::kYes),
                    test::query_values(frame, format));
      }
      ++seen;
    }
  }
  EXPECT_EQ(seen, 5 * 3 + 24);  // 0x280 in five generations without MS, the others in both V2.36
}

/// Returns the bits of `data` that belong to no field.
Payload unnamed(const std::vector<Field>& fields, Payload data) {
  data[0] = 0;
  const Payload all_data = data;
  for (const Field& field : fields) {
    if (!present(fields, field, all_data)) continue;
    for (unsigned bit = field.first_bit; bit < field.first_bit + field.bits; ++bit) {
      data[bit / 8] &= static_cast<std::uint8_t>(~(1U << (bit % 8)));
    }
  }
  return data;
}

TEST(Fields, CoverAllBytesOfTheCodec) {
  for_all(true, [](const WireFormat& format, const CommandInfo& command, const Payload& data) {
    if (command.echoed) return;
    const auto reply = decode_reply(Frame{.id = 0x141, .data = data}, format);
    const auto written = encode_reply(1, std::get<protocol::ReplyFrame>(reply).reply, format);
    EXPECT_EQ(unnamed(fields_of(command.reply, format), written.data), Payload{});
  });
  for_all(false, [](const WireFormat& format, const CommandInfo& command, const Payload& data) {
    const auto query = decode_query(Frame{.id = 0x141, .data = data}, format);
    const auto written = encode_query(1, std::get<protocol::Query>(query).command, format);
    EXPECT_EQ(unnamed(fields_of(command.query, format), written.data), Payload{});
  });
}

TEST(Fields, EchoesMatchTheCodec) {
  for (const WireFormat& format : all_formats()) {
    for (const CommandInfo& command : protocol::commands()) {
      if (!protocol::knows(format, command)) continue;
      const auto opcode = command.opcode;
      Payload data{static_cast<std::uint8_t>(opcode)};
      if (opcode == protocol::ReadParameter::kOpcode || opcode == protocol::WriteParameter::kOpcode)
        data[1] = 0x0A;
      if (opcode == protocol::ReadStoredSetting::kOpcode ||
          opcode == protocol::WriteStoredSetting::kOpcode ||
          opcode == protocol::SaveSettings::kOpcode)
        data = {data[0], 0x05, 0x0A};
      const auto reply = decode_reply(Frame{.id = 0x141, .data = data}, format);
      const auto& content = std::get<protocol::ReplyFrame>(reply).reply;
      EXPECT_EQ(command.echoed, std::holds_alternative<protocol::Echo>(content)) << command.name;
    }
  }
}

/// Returns the selector values for which a field is present.
std::map<std::string_view, unsigned> selectors(const std::vector<Field>& fields,
                                               const Field& field) {
  std::map<std::string_view, unsigned> all;
  const Field* one = &field;
  while (!one->selector.empty()) {
    all.emplace(one->selector, one->only_at);
    one = &*std::ranges::find(fields, one->selector, &Field::name);
  }
  return all;
}

/// Returns whether the fields exclude each other by a selector.
bool never_both(const std::vector<Field>& fields, const Field& one, const Field& other) {
  const auto others = selectors(fields, other);
  return std::ranges::any_of(selectors(fields, one), [&](const auto& selector) {
    const auto found = others.find(selector.first);
    return found != others.end() && found->second != selector.second;
  });
}

// DBC readers refuse bits or names with two meanings.
TEST(Fields, BitsAndNamesAreUnique) {
  for (const WireFormat& format : all_formats()) {
    for (const bool reply : {false, true}) {
      std::map<std::string_view, Field> known;
      for (const CommandInfo& command : protocol::commands()) {
        if (!protocol::knows(format, command)) continue;
        const auto fields = fields_of(reply ? command.reply : command.query, format);
        for (const Field& field : fields) {
          const Field& first = known.emplace(field.name, field).first->second;
          EXPECT_EQ(first.first_bit, field.first_bit) << field.name;
          EXPECT_EQ(first.bits, field.bits) << field.name;
          EXPECT_EQ(first.lsb, field.lsb) << field.name;
          EXPECT_EQ(first.selector, field.selector) << field.name;
          EXPECT_EQ(first.only_at, field.only_at) << field.name;
          EXPECT_GE(field.first_bit, 8U) << field.name << " lies on the command";
          EXPECT_LE(field.first_bit + field.bits, 64U) << field.name;
          for (const Field& other : fields) {
            const bool apart = other.first_bit >= field.first_bit + field.bits ||
                               field.first_bit >= other.first_bit + other.bits;
            const bool never_together = never_both(fields, field, other);
            EXPECT_TRUE(apart || never_together || &field == &other)
                << field.name << " lies on " << other.name;
          }
        }
      }
    }
  }
}

}  // namespace fields_test
}  // namespace lk::formats
