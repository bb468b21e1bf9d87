#include "protocol/command_info.hpp"

#include <algorithm>

#include "protocol/command_table.hpp"
#include "protocol/field_values.hpp"

namespace lk::protocol {
namespace {

/// The fields of a tuple of rows, without where their values are.
template <const auto& kRows, bool kOfQuery, std::size_t kPlace>
constexpr auto fields() {
  constexpr const auto& rows = []() -> const auto& {
    if constexpr (kOfQuery) {
      return at<kPlace>(kRows).query;
    } else {
      return at<kPlace>(kRows).reply;
    }
  }
  ();
  return [&]<std::size_t... N>(std::index_sequence<N...>) {
    return std::array<Field, sizeof...(N)>{at<N>(rows).field...};
  }
  (std::make_index_sequence<std::remove_cvref_t<decltype(rows)>::kSize>{});
}
template <const auto& kRows, bool kOfQuery, std::size_t kPlace>
constexpr auto kFields = fields<kRows, kOfQuery, kPlace>();

template <const auto& kRows, std::size_t kPlace>
constexpr CommandInfo info() {
  using Row = std::remove_cvref_t<decltype(at<kPlace>(kRows))>;
  using Query = typename Row::QueryType;
  CommandInfo info{at<kPlace>(kRows).traits};
  if constexpr (requires { Query::kOpcode; }) {
    info.opcode = Query::kOpcode;
  } else {
    info.identifier = Query::kIdentifier;
  }
  info.echoed = std::is_same_v<typename Row::ReplyType, Echo>;
  info.query = kFields<kRows, true, kPlace>;
  info.reply = info.echoed ? info.query : std::span<const Field>(kFields<kRows, false, kPlace>);
  return info;
}

template <const auto& kRows, std::size_t... kPlaces>
constexpr auto infos(std::index_sequence<kPlaces...>) {
  return std::array{info<kRows, kPlaces>()...};
}
template <const auto& kRows>
constexpr auto kInfos =
    infos<kRows>(std::make_index_sequence<std::remove_cvref_t<decltype(kRows)>::kSize>{});

constexpr const auto& kCommands = kInfos<kCommandRows>;
constexpr const auto& kMultiDriveCommands = kInfos<kMultiDriveRows>;
static_assert(std::ranges::adjacent_find(kCommands, std::ranges::greater_equal{},
                                         &CommandInfo::opcode) == kCommands.end(),
              "command bytes ascend, so each stands once");
static_assert(std::ranges::adjacent_find(kMultiDriveCommands, std::ranges::greater_equal{},
                                         &CommandInfo::identifier) == kMultiDriveCommands.end(),
              "identifiers ascend, so each stands once");

/// Where the command of a byte is; beyond the last: nowhere.
constexpr std::array<std::uint8_t, 256> kPlaces = [] {
  std::array<std::uint8_t, 256> places{};
  places.fill(0xFF);
  for (std::size_t place = 0; place < kCommands.size(); ++place) {
    places[static_cast<std::size_t>(kCommands[place].opcode)] = static_cast<std::uint8_t>(place);
  }
  return places;
}();

}  // namespace

std::span<const CommandInfo> commands() { return kCommands; }
std::span<const CommandInfo> multi_drive_commands() { return kMultiDriveCommands; }

const CommandInfo* find_command(std::uint8_t byte) {
  const std::size_t place = kPlaces[byte];
  return place < kCommands.size() ? &kCommands[place] : nullptr;
}

bool has_state(std::uint8_t byte) {
  const CommandInfo* command = find_command(byte);
  return command != nullptr && !command->reply.empty() &&
         command->reply.front().unit == Unit::kCelsius;
}

const CommandInfo* find_multi_drive(std::uint32_t identifier) {
  const auto row = std::ranges::find(kMultiDriveCommands, identifier, &CommandInfo::identifier);
  return row != kMultiDriveCommands.end() ? &*row : nullptr;
}

std::vector<std::string_view> reply_words() {
  std::vector<std::string_view> words;
  for (const CommandInfo& command : kCommands) {
    if (command.echoed) continue;
    for (const Field& field : command.reply) {
      const auto word = field.spoken();
      if (std::ranges::find(words, word) == words.end()) words.push_back(word);
    }
  }
  return words;
}

std::optional<double> reply_quantity(std::string_view word, const Payload& data,
                                     const WireFormat& format) {
  const CommandInfo* command = find_command(data[0]);
  if (command == nullptr || command->echoed) return std::nullopt;
  const auto is_it = [&](const Field& field) {
    return field.spoken() == word && present(field, data[1], format);
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
  const CommandInfo* command = find_command(static_cast<std::uint8_t>(opcode));
  return command != nullptr && knows(format, *command);
}

bool knows_multi_drive(const WireFormat& format, std::uint32_t identifier) {
  const CommandInfo* command = find_multi_drive(identifier);
  return command != nullptr && knows(format, *command);
}

}  // namespace lk::protocol
