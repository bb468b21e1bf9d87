#pragma once

/// @file Templates for codec.cpp and encode.cpp: read and write frames by the rows of the tables.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <tuple>
#include <type_traits>
#include <utility>

#include "protocol/field_values.hpp"
#include "protocol/serial_table.hpp"

namespace lk::protocol::row_codec {

/// Integer type of a field on the wire.
template <Wire kWire>
using Integer = std::tuple_element_t<
    static_cast<std::size_t>(kWire),
    std::tuple<std::uint8_t, std::int8_t, std::uint16_t, std::int16_t, std::uint32_t, std::int32_t,
               std::int64_t, std::uint32_t, std::int64_t>>;

template <Wire kWire>
std::int64_t get(const Payload& data, std::size_t at) {
  if constexpr (kWire == Wire::kI56) {
    return get_le56(data);
  } else if constexpr (kWire == Wire::kU24) {
    return get_le<std::uint32_t>(data, at) & 0xFF'FFFFU;
  } else {
    return get_le<Integer<kWire>>(data, at);
  }
}

template <Wire kWire>
void put(Payload& data, std::size_t at, std::int64_t number) {
  if constexpr (kWire == Wire::kI56) {
    put_le56(data, number);
  } else if constexpr (kWire == Wire::kU24) {
    put_le(data, at, static_cast<std::uint16_t>(number));
    data[at + 2] = static_cast<std::uint8_t>(number >> 16);
  } else {
    put_le(data, at, static_cast<Integer<kWire>>(number));
  }
}

/// Returns the limits to which the codec clamps: the range if Beyond::kClamped, else all numbers
/// that fit in the field.
template <Range kRange, Beyond kBeyond, Wire kWire>
RawRange held_to(const WireFormat& format) {
  constexpr bool kHeld = kBeyond == Beyond::kClamped && kRange != Range::kWidth;
  if constexpr (kHeld) {
    return raw_range(kRange, kWire, format);
  } else {
    return width(kWire);
  }
}

/// Converts a number on the wire to the value of a member of a command or reply.
template <class Member, Scale kScale>
Member value_of(std::int64_t number, const WireFormat& format) {
  if constexpr (std::is_floating_point_v<Member>) {
    return static_cast<double>(number) * lsb(kScale, format);
  } else if constexpr (kScale == Scale::kBridge) {
    return number != kBridgeOff;
  } else {
    return static_cast<Member>(number);  // bool: n != 0
  }
}

/// Converts the value of a member to the number on the wire.
template <Wire kWire, Scale kScale, class Member>
std::int64_t number_of(Member value, const RawRange& range, const WireFormat& format) {
  if constexpr (std::is_floating_point_v<Member>) {
    using Number = Integer<kWire>;
    return quantize<Number>(value, lsb(kScale, format), static_cast<Number>(range.min),
                            static_cast<Number>(range.max));
  } else if constexpr (kScale == Scale::kBridge) {
    return value ? format.dialect.state_on_byte : kBridgeOff;
  } else {
    return std::clamp(static_cast<std::int64_t>(value), range.min, range.max);
  }
}

enum class Side : std::uint8_t { kQuery, kReply };

/// Returns the field rows of the query or reply of the command at index `kPlace` of `kRows`.
template <const auto& kRows, std::size_t kPlace, Side kSide>
constexpr const auto& field_rows() {
  if constexpr (kSide == Side::kQuery) {
    return at<kPlace>(kRows).query;
  } else {
    return at<kPlace>(kRows).reply;
  }
}

/// Calls `act` with the index of each field as a std::integral_constant.
template <const auto& kRows, std::size_t kPlace, Side kSide, class Act>
void for_fields(Act act) {
  using Fields = std::remove_cvref_t<decltype(field_rows<kRows, kPlace, kSide>())>;
  [&]<std::size_t... N>(std::index_sequence<N...>) {
    (act(std::integral_constant<std::size_t, N>{}), ...);
  }
  (std::make_index_sequence<Fields::kSize>{});
}

/// Reads all fields of a query or reply from DATA.
template <const auto& kRows, std::size_t kPlace, Side kSide, class Owner>
void read_fields(Owner& owner, const Payload& data, const WireFormat& format) {
  for_fields<kRows, kPlace, kSide>([&]<std::size_t N>(std::integral_constant<std::size_t, N>) {
    constexpr const auto& row = at<N>(field_rows<kRows, kPlace, kSide>());
    constexpr const Field& field = row.field;
    if (!present(field, data, format)) return;
    std::int64_t number = get<field.wire>(data, field.byte);
    // Clamps fields of queries, as drives do. A drive has clamped the fields of a reply already.
    if constexpr (kSide == Side::kQuery) {
      const RawRange range = held_to<field.range, field.beyond, field.wire>(format);
      number = std::clamp(number, range.min, range.max);
    }
    auto& member = std::invoke(row.member, owner);
    member = value_of<std::remove_cvref_t<decltype(member)>, field.scale>(number, format);
  });
}

/// Writes all fields to DATA. Returns the number of bytes used, from DATA[0] on.
template <const auto& kRows, std::size_t kPlace, Side kSide, class Owner>
std::uint8_t write_fields(Payload& data, const Owner& owner, const WireFormat& format) {
  std::uint8_t size = 1;
  for_fields<kRows, kPlace, kSide>([&]<std::size_t N>(std::integral_constant<std::size_t, N>) {
    constexpr const auto& row = at<N>(field_rows<kRows, kPlace, kSide>());
    constexpr const Field& field = row.field;
    if (!present(field, data, format)) return;
    const std::int64_t number = number_of<field.wire, field.scale>(
        std::invoke(row.member, owner), held_to<field.range, field.beyond, field.wire>(format),
        format);
    if (field.optional && number == 0) return;
    put<field.wire>(data, field.byte, number);
    constexpr auto kEnd = std::max<std::uint8_t>(field.byte + bytes_of(field.wire), field.end);
    size = std::max(size, kEnd);
  });
  return size;
}

}  // namespace lk::protocol::row_codec
