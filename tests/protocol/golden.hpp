#pragma once

/// @file Checks of the codec for rows of golden bytes, on CAN ("141#9A...") and on RS-485 ("3E 9A
/// ..."). A row has a `text`, a `command` or a `reply`, and maybe a `format` and an `id`.

#include <gtest/gtest.h>

#include <algorithm>
#include <initializer_list>

#include "protocol/codec.hpp"
#include "tests/support/frames.hpp"
#include "tests/support/serial.hpp"
#include "tests/support/sweep.hpp"

namespace lk::protocol {

inline Frame parsed(const char* text, const WireFormat& format) {
  return format.dialect.framing == Framing::kSerial ? test::packet(text) : test::frame(text);
}

template <class Golden>
int id_of(const Golden& golden) {
  if constexpr (requires { golden.id; }) {
    return golden.id;
  } else {
    return 1;
  }
}
template <class Golden>
const WireFormat& format_of(const Golden& golden, const WireFormat& otherwise) {
  if constexpr (requires { golden.format; }) {
    return golden.format;
  } else {
    return otherwise;
  }
}

/// Encodes and decodes each query.
template <class Goldens>
void expect_queries(const Goldens& goldens, const WireFormat& otherwise = kLegacyFormat) {
  for (const auto& golden : goldens) {
    const WireFormat& format = format_of(golden, otherwise);
    const Frame frame = parsed(golden.text, format);
    EXPECT_EQ(encode_query(id_of(golden), golden.command, format), frame) << golden.text;
    const auto result = decode_query(frame, format);
    const auto* query = std::get_if<Query>(&result);
    ASSERT_NE(query, nullptr) << golden.text;
    EXPECT_EQ(query->id, id_of(golden)) << golden.text;
    EXPECT_EQ(query->command, golden.command) << golden.text;
    EXPECT_EQ(query->data, frame.data) << golden.text;
  }
}

/// Encodes each reply, and decodes it to a reply of the same kind and bytes.
template <class Goldens>
void expect_replies(const Goldens& goldens, const WireFormat& otherwise = kLegacyFormat) {
  for (const auto& golden : goldens) {
    const WireFormat& format = format_of(golden, otherwise);
    const Frame frame = parsed(golden.text, format);
    EXPECT_EQ(encode_reply(id_of(golden), golden.reply, format), frame) << golden.text;
    const auto result = decode_reply(frame, format);
    const auto* reply = std::get_if<ReplyFrame>(&result);
    ASSERT_NE(reply, nullptr) << golden.text;
    EXPECT_EQ(reply->id, id_of(golden)) << golden.text;
    EXPECT_EQ(reply->reply.index(), golden.reply.index()) << golden.text;
    EXPECT_EQ(encode_reply(reply->id, reply->reply, format), frame) << golden.text;
  }
}

/// Each command that drives of the format know has a row; other commands: dialect_test.cpp.
template <class Goldens>
void expect_every_command(const Goldens& goldens, const WireFormat& format = kLegacyFormat) {
  for (const CommandInfo& row : commands()) {
    if (!knows(format, row)) continue;
    EXPECT_TRUE(std::ranges::any_of(goldens, [&](const auto& golden) {
      return id_of(golden) != kMultiDrive &&
             test::frame(golden.text).data[0] == static_cast<int>(row.opcode);
    })) << row.name;
  }
}

/// A 16-bit field of a frame, at DATA[at].
struct SixteenBits {
  const char* text;
  std::size_t at;
  int min = 0, max = 65535;
  WireFormat format = kLegacyFormat;
};

/// Each value of the fields is unchanged by decode and encode.
inline void expect_unchanged(std::initializer_list<SixteenBits> fields, bool replies) {
  for (const SixteenBits& field : fields) {
    Frame frame = test::frame(field.text);
    for (const int n : test::sweep(field.min, field.max, {0x8000})) {
      put_le(frame.data, field.at, static_cast<std::uint16_t>(n));
      const Frame again =
          replies ? encode_reply(1, std::get<ReplyFrame>(decode_reply(frame, field.format)).reply,
                                 field.format)
                  : encode_query(1, std::get<Query>(decode_query(frame, field.format)).command,
                                 field.format);
      ASSERT_EQ(again, frame);
    }
  }
}

/// Each value of a query's field is decoded to `value_of(command)`: the value within the field's
/// limits, times `lsb`. Encoded again, the field has the value within its limits.
template <class Kind, class ValueOf>
void expect_clamped(const SixteenBits& field, double lsb, ValueOf value_of) {
  Frame query = test::frame(field.text);
  for (const int n : test::sweep(-32768, 32767, {field.min, field.max})) {
    put_le(query.data, field.at, static_cast<std::int16_t>(n));
    const auto command = std::get<Kind>(std::get<Query>(decode_query(query, field.format)).command);
    const int held = std::clamp(n, field.min, field.max);
    ASSERT_NEAR(value_of(command), held * lsb, 1e-12);
    put_le(query.data, field.at, static_cast<std::int16_t>(held));
    ASSERT_EQ(encode_query(1, command, field.format), query);
  }
}

}  // namespace lk::protocol
