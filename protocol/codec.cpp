#include "protocol/codec.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <functional>
#include <tuple>
#include <type_traits>
#include <utility>

#include "protocol/field_values.hpp"

namespace lk::protocol {
namespace {

/// The integer of the wire that a field is.
template <Wire kWire>
using Integer =
    std::tuple_element_t<static_cast<std::size_t>(kWire),
                         std::tuple<std::uint8_t, std::int8_t, std::uint16_t, std::int16_t,
                                    std::uint32_t, std::int32_t, std::int64_t>>;

template <Wire kWire>
std::int64_t get(const Payload& data, std::size_t at) {
  if constexpr (kWire == Wire::kI56) {
    return get_le56(data);
  } else {
    return get_le<Integer<kWire>>(data, at);
  }
}

template <Wire kWire>
void put(Payload& data, std::size_t at, std::int64_t number) {
  if constexpr (kWire == Wire::kI56) {
    put_le56(data, number);
  } else {
    put_le(data, at, static_cast<Integer<kWire>>(number));
  }
}

/// Where the codec holds a number: in its range, or, if that is the drive's to know, in its width.
template <Range kRange, Beyond kBeyond, Wire kWire>
RawRange held_to(const WireFormat& format) {
  constexpr bool kHeld = kBeyond == Beyond::kClamped && kRange != Range::kWidth;
  if constexpr (kHeld) {
    return raw_range(kRange, kWire, format);
  } else {
    return width(kWire);
  }
}

/// The value of a member, of the number on the wire.
template <class Member, Scale kScale>
Member value_of(std::int64_t number, const WireFormat& format) {
  if constexpr (std::is_floating_point_v<Member>) {
    return static_cast<double>(number) * lsb(kScale, format);
  } else if constexpr (kScale == Scale::kBridge) {
    return number != kBridgeOff;
  } else {
    return static_cast<Member>(number);  // a bool: not 0
  }
}

/// The number on the wire of a member's value.
template <Wire kWire, Scale kScale, class Member>
std::int64_t number_of(Member value, const RawRange& range, const WireFormat& format) {
  if constexpr (std::is_floating_point_v<Member>) {
    using Number = Integer<kWire>;
    return quantize<Number>(value, lsb(kScale, format), static_cast<Number>(range.min),
                            static_cast<Number>(range.max));
  } else if constexpr (kScale == Scale::kBridge) {
    return value ? 0 : kBridgeOff;
  } else {
    return std::clamp(static_cast<std::int64_t>(value), range.min, range.max);
  }
}

enum class Side : std::uint8_t { kQuery, kReply };

/// The rows of the fields of the command at `kPlace` of `kRows`.
template <const auto& kRows, std::size_t kPlace, Side kSide>
constexpr const auto& field_rows() {
  if constexpr (kSide == Side::kQuery) {
    return at<kPlace>(kRows).query;
  } else {
    return at<kPlace>(kRows).reply;
  }
}

/// Calls `act` with the place of each field, as a constant.
template <const auto& kRows, std::size_t kPlace, Side kSide, class Act>
void for_fields(Act act) {
  using Fields = std::remove_cvref_t<decltype(field_rows<kRows, kPlace, kSide>())>;
  [&]<std::size_t... N>(std::index_sequence<N...>) {
    (act(std::integral_constant<std::size_t, N>{}), ...);
  }
  (std::make_index_sequence<Fields::kSize>{});
}

/// Reads all fields of a query or reply of the kind.
template <const auto& kRows, std::size_t kPlace, Side kSide, class Owner>
void read_fields(Owner& owner, const Payload& data, const WireFormat& format) {
  for_fields<kRows, kPlace, kSide>([&]<std::size_t N>(std::integral_constant<std::size_t, N>) {
    constexpr const auto& row = at<N>(field_rows<kRows, kPlace, kSide>());
    constexpr const Field& field = row.field;
    if (!present(field, data[1], format)) return;
    std::int64_t number = get<field.wire>(data, field.byte);
    // Drives clamp what they are told; what they say they have clamped themselves.
    if constexpr (kSide == Side::kQuery) {
      const RawRange range = held_to<field.range, field.beyond, field.wire>(format);
      number = std::clamp(number, range.min, range.max);
    }
    auto& member = std::invoke(row.member, owner);
    member = value_of<std::remove_cvref_t<decltype(member)>, field.scale>(number, format);
  });
}

template <const auto& kRows, std::size_t kPlace, Side kSide, class Owner>
void write_fields(Payload& data, const Owner& owner, const WireFormat& format) {
  for_fields<kRows, kPlace, kSide>([&]<std::size_t N>(std::integral_constant<std::size_t, N>) {
    constexpr const auto& row = at<N>(field_rows<kRows, kPlace, kSide>());
    constexpr const Field& field = row.field;
    if (!present(field, data[1], format)) return;
    put<field.wire>(data, field.byte,
                    number_of<field.wire, field.scale>(
                        std::invoke(row.member, owner),
                        held_to<field.range, field.beyond, field.wire>(format), format));
  });
}

template <const auto& kRows>
constexpr std::size_t kCount = std::remove_cvref_t<decltype(kRows)>::kSize;
template <const auto& kRows, std::size_t kPlace>
using RowAt = std::remove_cvref_t<decltype(at<kPlace>(kRows))>;

/// The place of a kind of reply: that of the first command that has it.
template <class Kind, std::size_t N = 0>
constexpr std::size_t reply_place() {
  if constexpr (std::is_same_v<typename RowAt<kCommandRows, N>::ReplyType, Kind>) {
    return N;
  } else {
    return reply_place<Kind, N + 1>();
  }
}

/// A function for each row of a table, by its place.
template <const auto& kRows, class Make>
constexpr auto for_each_row(Make make) {
  return [&]<std::size_t... kPlaces>(std::index_sequence<kPlaces...>) {
    return std::array{make(std::integral_constant<std::size_t, kPlaces>{})...};
  }
  (std::make_index_sequence<kCount<kRows>>{});
}

using ReadCommand = Command (*)(const Payload&, const WireFormat&);
template <const auto& kRows>
constexpr std::array kReadCommand =
    for_each_row<kRows>([]<std::size_t N>(std::integral_constant<std::size_t, N>) -> ReadCommand {
      return [](const Payload& data, const WireFormat& format) -> Command {
        typename RowAt<kRows, N>::QueryType query;
        read_fields<kRows, N, Side::kQuery>(query, data, format);
        return query;
      };
    });

using ReadReply = Reply (*)(const Payload&, const WireFormat&);
constexpr std::array kReadReply = for_each_row<kCommandRows>(
    []<std::size_t N>(std::integral_constant<std::size_t, N>) -> ReadReply {
      return [](const Payload& data, const WireFormat& format) -> Reply {
        using Kind = typename RowAt<kCommandRows, N>::ReplyType;
        Kind reply;
        if constexpr (std::is_same_v<Kind, Echo>) {
          reply.data = data;
        } else {
          if constexpr (requires { reply.command; }) reply.command = static_cast<Opcode>(data[0]);
          read_fields<kCommandRows, reply_place<Kind>(), Side::kReply>(reply, data, format);
        }
        return reply;
      };
    });

/// The place of a command in its table.
std::size_t place_of(const CommandInfo& command) {
  return static_cast<std::size_t>(
      &command - (command.identifier != 0 ? multi_drive_commands().data() : commands().data()));
}

/// Is a value given that is not in the list of those that are known?
bool has_unknown(std::span<const Field> fields, const Payload& data) {
  return std::ranges::any_of(fields, [&data](const Field& field) {
    return field.beyond == Beyond::kUnknownCommand &&
           std::ranges::find(field.values, static_cast<unsigned>(data[field.byte]),
                             &Value::number) == field.values.end();
  });
}

/// A query to one drive.
std::variant<Query, Reject> decode_single(int id, const Payload& data, const WireFormat& format) {
  const CommandInfo* command = find_command(data[0]);
  if (command == nullptr || !knows(format, *command) || has_unknown(command->query, data)) {
    return Reject::kUnknownCommand;
  }
  return Query{id, kReadCommand<kCommandRows>[place_of(*command)](data, format), data};
}

}  // namespace

bool is_multi_drive(const Command& command) { return command.index() >= kCount<kCommandRows>; }

const CommandInfo& info_of(const Command& command) {
  const std::size_t place = command.index();
  return is_multi_drive(command) ? multi_drive_commands()[place - kCount<kCommandRows>]
                                 : commands()[place];
}

std::optional<std::uint8_t> reply_command(const Command& command) {
  if (std::holds_alternative<MultiCommand>(command)) return std::nullopt;
  const CommandInfo& info = info_of(command);
  return static_cast<std::uint8_t>(is_multi_drive(command) ? info.each : info.opcode);
}

std::variant<int, Reject> address(const Frame& frame) {
  switch (frame.kind) {
    case FrameKind::kError:
      return Reject::kErrorFrame;
    case FrameKind::kFd:
      return Reject::kCanFd;
    case FrameKind::kRemote:
      return Reject::kRemote;
    case FrameKind::kData:
      break;
  }
  if (frame.extended) {
    return Reject::kExtended;
  }
  const int id = drive_at(frame.id, kSingleDriveId);
  if (id == 0 && find_multi_drive(frame.id) == nullptr) {
    return Reject::kForeignId;
  }
  if (frame.dlc != frame.data.size()) {
    return Reject::kWrongLength;
  }
  return id;  // 0 is kMultiDrive
}

std::variant<Query, Reject> decode_query(const Frame& frame, const WireFormat& format) {
  const auto addressed = address(frame);
  if (const auto* reject = std::get_if<Reject>(&addressed)) {
    return *reject;
  }
  const int id = std::get<int>(addressed);
  if (id != kMultiDrive) {
    return decode_single(id, frame.data, format);
  }
  const CommandInfo* command = find_multi_drive(frame.id);
  if (command == nullptr || !knows(format, *command)) {
    return frame.id == MultiTorque::kIdentifier ? Reject::kUnknownCommand : Reject::kForeignId;
  }
  return Query{id, kReadCommand<kMultiDriveRows>[place_of(*command)](frame.data, format),
               frame.data};
}

std::variant<Query, Reject> for_drive(int id, const Query& query, const WireFormat& format) {
  const auto* multi = std::get_if<MultiCommand>(&query.command);
  if (multi == nullptr) {
    return query;
  }
  const auto slot = static_cast<std::size_t>(id - kMinId);
  if (slot >= multi->opcodes.size() || multi->opcodes[slot] == kNoCommand) {
    return Reject::kForeignId;
  }
  return decode_single(id, Payload{multi->opcodes[slot]}, format);
}

namespace {

/// Writes the query whose row is at `kPlace` of both tables in a row.
template <std::size_t kPlace, class Kind>
void write_query(Frame& frame, int id, const Kind& command, const WireFormat& format) {
  if constexpr (kPlace < kCount<kCommandRows>) {
    assert(id >= kMinId && id <= kMaxId);
    frame.id = kSingleDriveId + static_cast<std::uint32_t>(id);
    frame.data[0] = static_cast<std::uint8_t>(Kind::kOpcode);
    write_fields<kCommandRows, kPlace, Side::kQuery>(frame.data, command, format);
  } else {
    frame.id = Kind::kIdentifier;
    write_fields<kMultiDriveRows, kPlace - kCount<kCommandRows>, Side::kQuery>(frame.data, command,
                                                                               format);
  }
}

/// The place of a kind of command among the alternatives.
template <class Kind, std::size_t N = 0>
constexpr std::size_t command_place() {
  if constexpr (std::is_same_v<std::variant_alternative_t<N, Command>, Kind>) {
    return N;
  } else {
    return command_place<Kind, N + 1>();
  }
}

struct ReplyWriter {
  Payload& data;
  const WireFormat& format;

  void operator()(const Echo& reply) const { data = reply.data; }
  template <class Kind>
  void operator()(const Kind& reply) const {
    constexpr std::size_t kPlace = reply_place<Kind>();
    if constexpr (requires { reply.command; }) {
      data[0] = static_cast<std::uint8_t>(reply.command);
    } else {
      data[0] = static_cast<std::uint8_t>(RowAt<kCommandRows, kPlace>::QueryType::kOpcode);
    }
    write_fields<kCommandRows, kPlace, Side::kReply>(data, reply, format);
  }
};

}  // namespace

Frame encode_query(int id, const Command& command, const WireFormat& format) {
  Frame frame;
  std::visit([&]<class Kind>(
                 const Kind& kind) { write_query<command_place<Kind>()>(frame, id, kind, format); },
             command);
  return frame;
}

Frame encode_reply(int id, const Reply& reply, const WireFormat& format) {
  assert(id >= kMinId && id <= kMaxId);
  Frame frame;
  frame.id = format.dialect.reply_id_base + static_cast<std::uint32_t>(id);
  std::visit(ReplyWriter{frame.data, format}, reply);
  return frame;
}

std::variant<ReplyFrame, Reject> decode_reply(const Frame& frame, const WireFormat& format) {
  // Where replies have identifiers of their own, they pass the same checks as queries would.
  Frame as_query = frame;
  as_query.id = frame.id - format.dialect.reply_id_base + kSingleDriveId;
  const auto addressed = address(as_query);
  if (const auto* reject = std::get_if<Reject>(&addressed)) {
    return *reject;
  }
  const int id = std::get<int>(addressed);
  if (id == kMultiDrive) {
    return Reject::kForeignId;  // no drive answers there
  }
  const CommandInfo* command = find_command(frame.data[0]);
  const bool unknown = command == nullptr || !knows(format, *command) ||
                       (!command->echoed && has_unknown(command->reply, frame.data));
  if (unknown) {
    return Reject::kUnknownCommand;
  }
  return ReplyFrame{id, kReadReply[place_of(*command)](frame.data, format)};
}

}  // namespace lk::protocol
