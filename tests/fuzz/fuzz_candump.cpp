// A CAN or RS-485 log of candump, and inputs of a recording, with any contents: refused in one
// line, or read; written again, they read equal.
//
// Input: a byte of settings, then the text. Bits 0..1: generation; bit 2: inputs of a recording;
// bit 3: compare the log with a drive; bit 4: decode as candump output; bits 5..6: JSON, Chinese;
// bit 7: guess the kinds of drives.

#include <cstddef>
#include <string>

#include "emulator/config/candump_log.hpp"
#include "emulator/config/config_error.hpp"
#include "emulator/core/generation.hpp"
#include "emulator/monitor/record/log_compare.hpp"
#include "emulator/monitor/record/recording.hpp"
#include "tests/fuzz/support.hpp"
#include "tools/decode/decoder.hpp"
#include "tools/guess/guesser.hpp"

namespace lk::emulator {
namespace {

using fuzz::require;

constexpr SimTime kMaxCompared = std::chrono::milliseconds(20);  // of simulated time

BusConfig bus_of(std::uint8_t settings, protocol::Framing framing) {
  BusConfig bus;
  bus.interface = "vcan0";
  bus.bitrate = 1'000'000;
  if (framing == protocol::Framing::kSerial) bus.serial = SerialConfig{};
  for (const int id : {1, 2}) {
    ServoConfig servo;
    servo.id = id;
    servo.generation = static_cast<Generation>(settings & 3U);
    servo.quirks = quirks_of(servo.generation, framing);
    servo.rom.broadcast_mode = id == 2;
    bus.servos.push_back(servo);
  }
  return bus;
}

/// Every line is unchanged by writing and reading again; times are truncated to microseconds.
void check_lines(const std::vector<CandumpLine>& log) {
  for (const CandumpLine& line : log) {
    const std::string text = candump_line(line.at, line.interface, line.frame, line.direction);
    const auto again = parse_candump_line(text);
    require(std::holds_alternative<CandumpLine>(again));
    CandumpLine expected = line;
    expected.number = 0;                                                          // no line number
    if (line.frame.kind == protocol::FrameKind::kRemote) expected.frame.dlc = 0;  // not written
    expected.at = std::chrono::floor<std::chrono::microseconds>(line.at);
    require(std::get<CandumpLine>(again) == expected);
  }
}

/// As `lk-emu replay --against`, if time does not go back.
void compare(const std::vector<CandumpLine>& log, const BusConfig& bus) {
  std::vector<LoggedFrame> frames;
  for (const CandumpLine& line : log) {
    const SimTime at = line.at - log.front().at;
    if (at < SimTime{0} || at > kMaxCompared) return;
    if (!frames.empty() && at < frames.back().timed.at) return;
    std::optional<bool> from_host;
    if (line.direction != CandumpLine::Direction::kUnknown) {
      from_host = line.direction == CandumpLine::Direction::kSent;
    }
    frames.push_back({{at, line.frame}, from_host});
  }
  const LogComparison compared = compare_log(frames, bus);
  require(compared.sent + compared.orphans + compared.unknown_drive_frames <= frames.size());
  require(!comparison_text(compared).empty());
}

void check_input(const std::string& line, const BusConfig& bus) {
  try {
    const RecordedInput input = parse_input(line, "directives.jsonl", 1);
    const std::string printed = print_input(input);
    require(print_input(parse_input(printed, "again", 1)) == printed);
    if (const auto* rom = std::get_if<RecordedInput::RestoredRom>(&input.what)) {
      restored_rom(*rom, "vcan0", bus.servos.front());
    }
  } catch (const ConfigError& problem) {
    fuzz::require_one_line(problem.what());
  }
}

/// As `lk-emu decode`: every line is a frame, skipped, or counted, and the output is safe for a
/// terminal.
void decode(std::uint8_t settings, std::string_view text) {
  DecodeOptions options;
  options.generation = static_cast<Generation>(settings & 3U);
  options.profile.series = static_cast<Series>(settings >> 2U & 3U);
  options.json = (settings & 32U) != 0;
  options.language = (settings & 64U) != 0 ? Language::kChinese : Language::kEnglish;
  Decoder decoder(options);
  std::string out;
  const std::uint64_t lines =
      fuzz::for_each_line(text, [&](auto line) { out += decoder.take(line); });
  out += decoder.finish();
  for (const char c : out) require(c == '\n' || static_cast<unsigned char>(c) >= 0x20);
  const DecodeSummary& summary = decoder.summary();
  require(summary.frames + summary.bad_lines <= lines && summary.buses.size() <= 32);
  std::uint64_t frames = 0;
  for (const auto& [interface, bus] : summary.buses) {
    frames += bus.frames;
    for (const auto& [key, command] : bus.commands) {
      require(command.unanswered + command.open + command.latency.count() <=
              command.queries + command.replies);
      require(command.queries <= lines && command.unclear <= lines);
    }
  }
  require(frames == summary.frames);
}

/// As `lk-emu decode --guess`: the output is bounded and safe for a terminal, and every finding was
/// in the log.
void guess(std::uint8_t settings, std::string_view text) {
  Guesser guesser({.json = (settings & 32U) != 0,
                   .language = (settings & 64U) != 0 ? Language::kChinese : Language::kEnglish});
  const std::uint64_t lines =
      fuzz::for_each_line(text, [&](auto line) { require(guesser.take(line).empty()); });
  const std::string out = guesser.finish();
  for (const char c : out) require(c == '\n' || static_cast<unsigned char>(c) >= 0x20);
  require(guesser.frames() + guesser.bad_lines() <= lines && guesser.buses().size() <= 32);
  for (const auto& [wire, bus] : guesser.buses()) {
    require(bus.drives.size() <= 32);
    for (const auto& [id, drive] : bus.drives) {
      const Guess guess = guess_of(drive.evidence());
      for (const Trait trait : guess.decided) {
        const ValueSet open = drive.evidence().open(trait);
        require(open != 0 && open != all_of(trait));
      }
      require(guess.fits.empty() == !guess.quirks.empty());
    }
  }
}

void check(std::uint8_t settings, const std::string& text) {
  if ((settings & 128U) != 0) {
    guess(settings, text);
    return;
  }
  if ((settings & 16U) != 0) {
    decode(settings, text);
    return;
  }
  if ((settings & 4U) != 0) {
    const BusConfig bus = bus_of(settings, protocol::Framing::kCan);
    fuzz::for_each_line(text, [&](auto line) { check_input(std::string(line), bus); });
    return;
  }
  try {
    const std::vector<CandumpLine> log = parse_candump_log(text, "log");
    check_lines(log);
    if ((settings & 8U) != 0 && !log.empty()) {
      compare(log, bus_of(settings, protocol::framing_of(log.front().frame)));
    }
  } catch (const ConfigError& problem) {
    fuzz::require_one_line(problem.what());
  }
}

}  // namespace
}  // namespace lk::emulator

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 0) lk::emulator::check(data[0], {reinterpret_cast<const char*>(data + 1), size - 1});
  return 0;
}
