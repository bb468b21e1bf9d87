#include "protocol/command_info.hpp"

#include <algorithm>

#include "protocol/command_table.hpp"
#include "protocol/field_values.hpp"
#include "protocol/row_codec.hpp"

namespace lk::protocol {
namespace {

/// The Field of each FieldRow of a query or reply.
template <const auto& kRows, row_codec::Side kSide, std::size_t kPlace>
constexpr auto kFields = []<std::size_t... N>(std::index_sequence<N...>) {
  return std::array<Field, sizeof...(N)>{
      at<N>(row_codec::field_rows<kRows, kPlace, kSide>()).field...};
}
(std::make_index_sequence<
    std::remove_cvref_t<decltype(row_codec::field_rows<kRows, kPlace, kSide>())>::kSize>{});

template <const auto& kRows, std::size_t kPlace>
constexpr CommandInfo info() {
  using row_codec::Side;
  using Row = row_codec::RowAt<kRows, kPlace>;
  using Query = typename Row::QueryType;
  CommandInfo info{at<kPlace>(kRows).traits};
  if constexpr (requires { Query::kOpcode; }) {
    info.opcode = Query::kOpcode;
  } else {
    info.identifier = Query::kIdentifier;
  }
  info.echoed = std::is_same_v<typename Row::ReplyType, Echo>;
  info.answered = !std::is_same_v<typename Row::ReplyType, NoReply>;
  info.query = kFields<kRows, Side::kQuery, kPlace>;
  info.reply =
      info.echoed ? info.query : std::span<const Field>(kFields<kRows, Side::kReply, kPlace>);
  return info;
}

template <const auto& kRows>
constexpr auto kInfos = []<std::size_t... kPlaces>(std::index_sequence<kPlaces...>) {
  return std::array{info<kRows, kPlaces>()...};
}
(std::make_index_sequence<row_codec::kCount<kRows>>{});

constexpr const auto& kCommands = kInfos<kCommandRows>;
constexpr const auto& kMultiDriveCommands = kInfos<kMultiDriveRows>;
constexpr const auto& kSerialCommands = kInfos<kSerialRows>;
constexpr const auto& kSerialMultiDriveCommands = kInfos<kSerialMultiDriveRows>;

template <class Code>
constexpr bool ascends(std::span<const CommandInfo> infos, Code CommandInfo::*code) {
  return std::ranges::adjacent_find(infos, std::ranges::greater_equal{}, code) == infos.end();
}
static_assert(ascends(kCommands, &CommandInfo::opcode) &&
                  ascends(kSerialCommands, &CommandInfo::opcode) &&
                  ascends(kMultiDriveCommands, &CommandInfo::identifier),
              "codes ascend, so each stands once");

/// Index of the command with DATA[0] = n in `kInfo`; 0xFF: none.
template <const auto& kInfo>
constexpr std::array<std::uint8_t, 256> kPlaces = [] {
  std::array<std::uint8_t, 256> places{};
  places.fill(0xFF);
  for (std::size_t place = 0; place < kInfo.size(); ++place) {
    places[static_cast<std::size_t>(kInfo[place].opcode)] = static_cast<std::uint8_t>(place);
  }
  return places;
}();
template <const auto& kInfo>
const CommandInfo* find_in(std::uint8_t byte) {
  const std::size_t place = kPlaces<kInfo>[byte];
  return place < kInfo.size() ? &kInfo[place] : nullptr;
}

}  // namespace

std::span<const CommandInfo> commands() { return kCommands; }
std::span<const CommandInfo> serial_commands() { return kSerialCommands; }
std::span<const CommandInfo> multi_drive_commands() { return kMultiDriveCommands; }
std::span<const CommandInfo> serial_multi_drive_commands() { return kSerialMultiDriveCommands; }

const CommandInfo* find_command(std::uint8_t byte, Framing framing) {
  return framing == Framing::kCan ? find_in<kCommands>(byte) : find_in<kSerialCommands>(byte);
}

bool has_state(std::uint8_t byte) {
  const CommandInfo* command = find_command(byte);
  return command != nullptr && !command->reply.empty() &&
         command->reply.front().unit == Unit::kCelsius;
}

const CommandInfo* find_multi_drive(std::uint32_t identifier, Framing framing) {
  const auto rows =
      framing == Framing::kCan ? multi_drive_commands() : serial_multi_drive_commands();
  const auto row = std::ranges::find(rows, identifier, &CommandInfo::identifier);
  return row != rows.end() ? &*row : nullptr;
}

PayloadLength payload_length(std::span<const Field> fields, const Payload& data,
                             const WireFormat& format) {
  int min = 1;
  int max = 1;
  for (const Field& field : fields) {
    if (!present(field, data, format)) continue;
    const int end = std::max<int>(field.byte + bytes_of(field.wire), field.end);
    max = std::max(max, end);
    if (!field.optional) min = std::max(min, end);
  }
  return {static_cast<std::uint8_t>(min - 1), static_cast<std::uint8_t>(std::max(min, max) - 1)};
}

std::vector<std::string_view> reply_words() {
  std::vector<std::string_view> words;
  for (const auto rows : {commands(), serial_commands()}) {
    for (const CommandInfo& command : rows) {
      if (command.echoed) continue;
      for (const Field& field : command.reply) {
        const auto word = field.input_key();
        if (std::ranges::find(words, word) == words.end()) words.push_back(word);
      }
    }
  }
  return words;
}

std::optional<double> reply_quantity(std::string_view word, const Payload& data,
                                     const WireFormat& format) {
  const CommandInfo* command = find_command(data[0], format.dialect.framing);
  if (command == nullptr || command->echoed) return std::nullopt;
  const auto is_it = [&](const Field& field) {
    return field.input_key() == word && present(field, data, format);
  };
  const auto field = std::ranges::find_if(command->reply, is_it);
  return field != command->reply.end() ? std::optional(quantity(*field, raw(*field, data), format))
                                       : std::nullopt;
}

bool fits(const CommandInfo& command, Series series) {
  switch (command.fits) {
    case Fits::kAllSeries:
      return true;
    case Fits::kMsOnly:
      return series == Series::kMs;
    case Fits::kAllButMs:
      return series != Series::kMs;
  }
  return false;
}

bool knows(const WireFormat& format, const CommandInfo& command) {
  return fits(command, format.series) && command.when.on(format);
}

bool answers(const WireFormat& format, Opcode opcode) {
  const CommandInfo* command =
      find_command(static_cast<std::uint8_t>(opcode), format.dialect.framing);
  return command != nullptr && knows(format, *command);
}

bool knows_multi_drive(const WireFormat& format, std::uint32_t identifier) {
  const CommandInfo* command = find_multi_drive(identifier, format.dialect.framing);
  return command != nullptr && knows(format, *command);
}

bool repeats_in_reply(const CommandInfo& command, const Field& field) {
  return field.beyond == Beyond::kUnknownCommand &&
         std::ranges::any_of(command.reply, [&](const Field& one) {
           return one.key == field.key && one.byte == field.byte;
         });
}

bool looks_like_query(const CommandInfo& command) {
  return !command.echoed && !command.query.empty() &&
         std::ranges::equal(command.query, command.reply, {}, &Field::name, &Field::name);
}

}  // namespace lk::protocol
