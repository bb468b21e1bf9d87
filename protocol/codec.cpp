#include "protocol/codec.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <iterator>
#include <utility>

#include "protocol/row_codec.hpp"

namespace lk::protocol {

using namespace row_codec;

namespace {

/// Returns an array with the result of `make` for each row of a table.
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

using ReadReply = Reply (*)(const Frame&, const WireFormat&);
template <const auto& kRows>
constexpr std::array kReadReply =
    for_each_row<kRows>([]<std::size_t N>(std::integral_constant<std::size_t, N>) -> ReadReply {
      return [](const Frame& frame, const WireFormat& format) -> Reply {
        using Kind = typename RowAt<kRows, N>::ReplyType;
        const Payload& data = frame.data;
        Kind reply;
        if constexpr (requires { reply.command; }) reply.command = static_cast<Opcode>(data[0]);
        if constexpr (std::is_same_v<Kind, Echo>) {
          reply.data = data;
          reply.size = frame.dlc;
        } else if constexpr (std::is_same_v<Kind, Block>) {
          std::copy(data.begin() + 1, data.end(), reply.data.begin());
          reply.size = static_cast<std::uint8_t>(frame.dlc - 1);
        } else {
          read_fields<kRows, reply_place<kRows, Kind>(), Side::kReply>(reply, data, format);
        }
        return reply;
      };
    });

/// Returns the index of a command in its table.
std::size_t place_of(const CommandInfo& command, bool serial) {
  const CommandInfo* const first =
      command.identifier != 0
          ? (serial ? serial_multi_drive_commands() : multi_drive_commands()).data()
          : (serial ? serial_commands() : commands()).data();
  return static_cast<std::size_t>(&command - first);
}

/// Returns true if a field that selects a parameter or setting has a value that no drive knows.
bool has_unknown(std::span<const Field> fields, const Payload& data, const WireFormat& format) {
  return std::ranges::any_of(fields, [&](const Field& field) {
    return field.beyond == Beyond::kUnknownCommand && present(field, data, format) &&
           std::ranges::find(field.values, static_cast<unsigned>(data[field.byte]),
                             &Value::number) == field.values.end();
  });
}

/// Returns true if the drive accepts this LEN for the command.
bool takes_length(const CommandInfo& command, std::uint8_t len, const Payload& data,
                  const WireFormat& format) {
  const PayloadLength right = command.query_len != nullptr
                                  ? PayloadLength{command.query_len(format), 0}
                                  : payload_length(command.query, data, format);
  if (len == right.min || (len == right.max && right.max > right.min)) return true;
  switch (command.wrong_length) {
    case WrongLength::kBySwitch:
      return format.dialect.lax_length;
    case WrongLength::kSilent:
      return false;
    case WrongLength::kAnswered:
      return true;
    case WrongLength::kEmptyTaken:
      return len == 0 || format.dialect.lax_length;
  }
  return false;
}

/// Decodes a query to one drive.
std::variant<Query, Reject> decode_single(int id, const Payload& data, std::uint8_t size,
                                          const WireFormat& format) {
  const bool serial = format.dialect.framing == Framing::kSerial;
  const CommandInfo* command = find_command(data[0], format.dialect.framing);
  if (command == nullptr || !knows(format, *command)) return Reject::kUnknownCommand;
  if (serial) {
    const auto len = static_cast<std::uint8_t>(size - 1);
    if (size == 0 || !takes_length(*command, len, data, format)) return Reject::kWrongLength;
  }
  if (has_unknown(command->query, data, format)) return Reject::kUnknownCommand;
  const ReadCommand read = serial ? kReadCommand<kSerialRows>[place_of(*command, true)]
                                  : kReadCommand<kCommandRows>[place_of(*command, false)];
  return Query{id, read(data, format), data, size};
}

/// Returns true if 0x288 can carry the command on RS-485.
constexpr bool fits_slot(std::uint8_t command) {
  constexpr Opcode kCan[] = {Off::kOpcode,        Stop::kOpcode,        Run::kOpcode,
                             ReadState1::kOpcode, ClearErrors::kOpcode, ReadState2::kOpcode};
  return std::ranges::find(kCan, static_cast<Opcode>(command)) != std::end(kCan);
}

/// Returns true if the frame is on the wire of the drive.
bool is_on_wire(const Frame& frame, const WireFormat& format) {
  return framing_of(frame) == format.dialect.framing;
}

/// Returns true if the reply has the length that `command` defines. Accepts any length if no field
/// describes the reply.
bool has_length(const CommandInfo& command, const Frame& frame, const WireFormat& format) {
  if (frame.dlc == 0) return false;
  if (command.echoed || command.reply.empty()) return true;
  return frame.dlc - 1 == payload_length(command.reply, frame.data, format).min;
}

}  // namespace

bool is_multi_drive(const Command& command) {
  return command.index() >= kCount<kCommandRows> &&
         command.index() < kCount<kCommandRows> + kCount<kMultiDriveRows>;
}

const CommandInfo& info_of(const Command& command, Framing framing) {
  return std::visit(
      [&]<class Kind>(const Kind&) -> const CommandInfo& {
        if constexpr (requires { Kind::kIdentifier; }) {
          const CommandInfo* const info = find_multi_drive(Kind::kIdentifier, framing);
          assert(info != nullptr);
          return *info;
        } else {
          const CommandInfo* const info =
              find_command(static_cast<std::uint8_t>(Kind::kOpcode), framing);
          assert(info != nullptr && "the wire has the command");
          return *info;
        }
      },
      command);
}

std::optional<std::uint8_t> reply_command(const Command& command) {
  if (std::holds_alternative<MultiCommand>(command) || std::holds_alternative<Restart>(command)) {
    return std::nullopt;
  }
  const Opcode opcode = std::visit(
      []<class Kind>(const Kind&) {
        if constexpr (requires { Kind::kIdentifier; }) {
          return at<query_place<kMultiDriveRows, Kind>()>(kMultiDriveRows).traits.each;
        } else {
          return Kind::kOpcode;
        }
      },
      command);
  return static_cast<std::uint8_t>(opcode);
}

std::variant<int, Reject> address(const Frame& frame) {
  switch (frame.kind) {
    case FrameKind::kError:
      return Reject::kErrorFrame;
    case FrameKind::kFd:
      return Reject::kCanFd;
    case FrameKind::kRemote:
      return Reject::kRemote;
    case FrameKind::kBytes:
      return Reject::kNoPacket;
    case FrameKind::kData:
    case FrameKind::kSerial:
      break;
  }
  if (frame.extended) {
    return Reject::kExtended;
  }
  const int id = drive_at(frame.id, kSingleDriveId);
  if (id == 0 && find_multi_drive(frame.id) == nullptr) {
    return Reject::kForeignId;
  }
  if (frame.kind == FrameKind::kData && frame.dlc != kCanBytes) {
    return Reject::kWrongLength;
  }
  return id;  // 0 is kMultiDrive
}

std::variant<Query, Reject> decode_query(const Frame& frame, const WireFormat& format) {
  const auto addressed = address(frame);
  if (const auto* reject = std::get_if<Reject>(&addressed)) {
    return *reject;
  }
  if (!is_on_wire(frame, format)) return Reject::kNoPacket;
  const int id = std::get<int>(addressed);
  if (id != kMultiDrive) {
    return decode_single(id, frame.data, frame.dlc, format);
  }
  const CommandInfo* command = find_multi_drive(frame.id, format.dialect.framing);
  if (command == nullptr || !knows(format, *command)) {
    return frame.id == MultiTorque::kIdentifier ? Reject::kUnknownCommand : Reject::kForeignId;
  }
  const ReadCommand read = is_serial(frame)
                               ? kReadCommand<kSerialMultiDriveRows>[place_of(*command, true)]
                               : kReadCommand<kMultiDriveRows>[place_of(*command, false)];
  return Query{id, read(frame.data, format), frame.data, frame.dlc};
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
  const std::uint8_t command = multi->opcodes[slot];
  if (format.dialect.framing == Framing::kCan) {
    return decode_single(id, Payload{command}, kCanBytes, format);
  }
  if (!fits_slot(command)) return Reject::kUnknownCommand;
  return decode_single(id, Payload{command}, 1, format);
}

std::variant<ReplyFrame, Reject> decode_reply(const Frame& frame, const WireFormat& format) {
  // Replaces the reply's identifier by the query's, so that address() can check the frame.
  Frame as_query = frame;
  as_query.id = frame.id - format.dialect.reply_id_base + kSingleDriveId;
  const auto addressed = address(as_query);
  if (const auto* reject = std::get_if<Reject>(&addressed)) {
    return *reject;
  }
  if (!is_on_wire(frame, format)) return Reject::kNoPacket;
  const int id = std::get<int>(addressed);
  if (id == kMultiDrive) {
    return Reject::kForeignId;  // multi-drive identifiers have no replies
  }
  const bool serial = format.dialect.framing == Framing::kSerial;
  const CommandInfo* command = find_command(frame.data[0], format.dialect.framing);
  const bool unknown = command == nullptr || !knows(format, *command) ||
                       (!command->echoed && has_unknown(command->reply, frame.data, format));
  if (unknown) {
    return Reject::kUnknownCommand;
  }
  if (serial && !has_length(*command, frame, format)) return Reject::kWrongLength;
  const ReadReply read = serial ? kReadReply<kSerialRows>[place_of(*command, true)]
                                : kReadReply<kCommandRows>[place_of(*command, false)];
  return ReplyFrame{id, read(frame, format)};
}

std::string_view to_string(Reject cause) {
  switch (cause) {
    case Reject::kErrorFrame:
      return "error frame";
    case Reject::kCanFd:
      return "CAN FD frame";
    case Reject::kRemote:
      return "remote request";
    case Reject::kExtended:
      return "extended identifier";
    case Reject::kForeignId:
      return "foreign identifier";
    case Reject::kNoSuchDrive:
      return "no such drive";
    case Reject::kWrongLength:
      return "wrong length";
    case Reject::kUnknownCommand:
      return "unknown command";
    case Reject::kWrongMode:
      return "wrong mode";
    case Reject::kNoPower:
      return "drive without power";
    case Reject::kDriveBusy:
      return "drive busy";
    case Reject::kFault:
      return "injected fault";
    case Reject::kQueueFull:
      return "queue full";
    case Reject::kNoPacket:
      return "no packet";
  }
  return "?";
}

}  // namespace lk::protocol
