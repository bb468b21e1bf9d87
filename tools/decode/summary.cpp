#include "tools/decode/summary.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

#include "emulator/core/generation.hpp"
#include "emulator/monitor/frames/decode_words.hpp"
#include "tools/decode/decode_output.hpp"

namespace lk::emulator {
namespace {

constexpr unsigned kBits = 5;                       // an octave has 2^kBits bins
constexpr std::uint64_t kExact_us = 2ULL << kBits;  // below, bins are 1 µs wide
constexpr std::uint64_t kMax_us = 1ULL << 40U;      // twelve days; larger values are clamped

std::size_t place_of(std::uint64_t us) {
  if (us < kExact_us) return us;
  const unsigned shift = static_cast<unsigned>(std::bit_width(us)) - kBits - 1;
  return (std::size_t{shift} << kBits) + (us >> shift);
}

/// Returns the middle of a bin.
SimTime middle_of(std::size_t place) {
  if (place < kExact_us) return std::chrono::microseconds(place);
  const std::size_t shift = (place >> kBits) - 1;
  const std::uint64_t first = (place - (shift << kBits)) << shift;
  return SimTime((first * 2 + (std::uint64_t{1} << shift)) * 500);
}

}  // namespace

void LatencyHistogram::add(SimTime latency) {
  if (latency < SimTime{0}) return;
  const auto us = static_cast<std::uint64_t>(latency.count()) / 1000;
  const std::size_t place = place_of(std::min(us, kMax_us));
  if (place >= counts_.size()) counts_.resize(place + 1);
  ++counts_[place];
  min_ = count_ == 0 ? latency : std::min(min_, latency);
  max_ = std::max(max_, latency);
  ++count_;
}

SimTime LatencyHistogram::quantile(double share) const {
  if (count_ == 0) return SimTime{0};
  const double wanted = std::ceil(share * static_cast<double>(count_));
  const auto rank = std::clamp<std::uint64_t>(static_cast<std::uint64_t>(wanted), 1, count_);
  std::uint64_t seen = 0;
  std::size_t place = 0;
  while ((seen += counts_[place]) < rank) ++place;
  return std::clamp(middle_of(place), min_, max_);
}

void BusTally::count(const FrameInfo& info, const FrameWords& words,
                     const std::optional<SimTime>& at) {
  ++frames;
  framing = protocol::framing_of(info.frame);
  if (at && !first_at) first_at = at;
  if (at) last_at = at;
  if (!words.problem.empty()) {
    ++meaningless[words.problem];
    const bool known_elsewhere =
        (info.drive > 0 || protocol::find_multi_drive(info.frame.id) != nullptr) &&
        !words.name.empty();
    if (known_elsewhere) ++of_newer_firmware;
    return;
  }
  if (info.role == Role::kOther) return;
  CommandTally& tally = commands[{info.drive, info.query_code}];
  if (info.role == Role::kQuery) ++tally.queries;
  if (info.role == Role::kUnclear) ++tally.unclear;
  if (info.role != Role::kReply) return;
  ++tally.replies;
  if (info.match_count == 0) ++tally.orphans;
  const auto state = std::ranges::find(words.quantities, "errors", &ReplyValue::name);
  if (state == words.quantities.end()) return;
  for (const std::string_view word : error_words(static_cast<unsigned>(state->value))) {
    ErrorTally& error = errors[{info.drive, word}];
    if (error.replies++ == 0) error.first_at = at;
  }
}

void BusTally::count(const QueryOutcome& settled) {
  CommandTally& tally = commands[{settled.drive, settled.query_code}];
  switch (settled.how) {
    case QueryOutcome::How::kUnanswered:
      ++tally.unanswered;
      break;
    case QueryOutcome::How::kOpen:
      ++tally.open;
      break;
    case QueryOutcome::How::kAnswered:
      if (settled.latency) tally.latency.add(*settled.latency);
      if (settled.was_unclear) {
        --tally.unclear;
        ++tally.queries;
      }
      break;
  }
}

std::optional<double> BusTally::duration_s() const {
  if (!first_at || !last_at) return std::nullopt;
  return std::max(in_seconds(*last_at - *first_at), 0.0);
}

std::optional<double> BusTally::rate_Hz(const CommandTally& command) const {
  const auto duration = duration_s();
  if (!duration || *duration <= 0) return std::nullopt;
  const std::uint64_t counted = command.queries > 0 ? command.queries : command.replies;
  return static_cast<double>(counted) / *duration;
}

namespace {

using Row = std::vector<std::string>;

constexpr std::size_t kLeft = 2;  // first columns, with text; the other columns have numbers

const BilingualText kHeads[] = {
    {"drive", "驱动器"},  {"command", "命令"},      {"queries", "命令帧"}, {"replies", "回复帧"},
    {"per s", "每秒"},    {"unanswered", "未应答"}, {"min ms", "最小 ms"}, {"median ms", "中位 ms"},
    {"p99 ms", "p99 ms"}, {"max ms", "最大 ms"},
};

/// Aligns the rows in columns.
std::string table(const std::vector<Row>& rows) {
  std::vector<std::size_t> widths(rows.front().size(), 0);
  for (const Row& row : rows) {
    for (std::size_t n = 0; n < row.size(); ++n) {
      widths[n] = std::max(widths[n], display_width(row[n]));
    }
  }
  std::string text;
  for (const Row& row : rows) {
    std::string line;
    for (std::size_t n = 0; n < row.size(); ++n) {
      line += "  " + (n < kLeft ? padded(row[n], widths[n]) : right(row[n], widths[n]));
    }
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

std::string ms(SimTime time) {
  return fmt::format("{:.3f}", static_cast<double>(time.count()) / 1e6);
}

std::string counted(std::uint64_t count) { return count > 0 ? std::to_string(count) : "–"; }

Row command_row(int drive, std::uint32_t asked, const CommandTally& command, const BusTally& bus,
                Language language) {
  Row row{drive > 0 ? std::to_string(drive) : "1-4",
          command_text(asked) + " " +
              std::string(in_language(command_name(asked, bus.framing), language)),
          counted(command.queries), counted(command.replies)};
  const auto rate = bus.rate_Hz(command);
  row.push_back(rate ? fmt::format("{:.1f}", *rate) : "–");
  row.push_back(counted(command.unanswered));
  const LatencyHistogram& latency = command.latency;
  for (const SimTime time :
       {latency.min(), latency.quantile(0.5), latency.quantile(0.99), latency.max()}) {
    row.push_back(latency.count() > 0 ? ms(time) : "–");
  }
  return row;
}

std::string instant(const std::optional<SimTime>& at, const BusTally& bus) {
  if (!at || !bus.first_at) return "–";
  return fmt::format("{:.6f} s", in_seconds(*at - *bus.first_at));
}

std::string errors_of(const BusTally& bus, Language language) {
  std::string text;
  for (const auto& [key, error] : bus.errors) {
    text += say({"  drive {}: {}, replies with it: {}, first {} after the first frame\n",
                 "  驱动器 {}：{}，见于 {} 个回复帧，首次在第一帧之后 {}\n"},
                language, key.first, in_language(key.second, language), error.replies,
                instant(error.first_at, bus));
  }
  return text;
}

std::string doubts_of(const BusTally& bus, const DecodeOptions& options) {
  const Language language = options.language;
  CommandTally all;
  for (const auto& [key, command] : bus.commands) {
    all.unclear += command.unclear;
    all.open += command.open;
    all.orphans += command.orphans;
  }
  const std::pair<std::uint64_t, BilingualText> doubts[] = {
      {all.unclear,
       {"  frames that could be query or reply: {}\n", "  分不清是命令帧还是回复帧的帧：{}\n"}},
      {all.open,
       {"  queries that may or may not have been answered: {}\n",
        "  不知道有没有得到应答的命令帧：{}\n"}},
      {all.orphans,
       {"  replies to no query in the log: {}\n", "  日志里没有对应命令帧的回复帧：{}\n"}}};
  std::string text;
  for (const auto& [count, words] : doubts) {
    if (count > 0) text += say(words, language, count);
  }
  for (const auto& [why, count] : bus.meaningless) {
    text += say({"  {}: {}\n", "  {}：{}\n"}, language, in_language(why, language), count);
  }
  if (bus.of_newer_firmware > 0) {
    text += say({"  known commands that such a drive of {} firmware does not take (see "
                 "--generation, --motor): {}\n",
                 "  这样的 {} 驱动器不接受的已知命令（见 --generation、--motor）：{}\n"},
                language, generation_name(options.generation), bus.of_newer_firmware);
  }
  return text;
}

std::string bus_text(const std::string& interface, const BusTally& bus,
                     const DecodeOptions& options) {
  const Language language = options.language;
  const BilingualText frames = bus.frames == 1 ? BilingualText{"\n{}: {} frame", "\n{}：{} 帧"}
                                               : BilingualText{"\n{}: {} frames", "\n{}：{} 帧"};
  std::string text = say(frames, language, interface, bus.frames);
  if (const auto duration = bus.duration_s()) {
    text += say({" in {:.6f} s", "，历时 {:.6f} s"}, language, *duration);
  }
  text += "\n";
  std::vector<Row> rows(1);
  for (const BilingualText& head : kHeads) rows.front().emplace_back(head.in(language));
  for (const auto& [key, command] : bus.commands) {
    if (command.queries + command.replies == 0) continue;
    rows.push_back(command_row(key.first, key.second, command, bus, language));
  }
  if (rows.size() > 1) text += table(rows);
  return text + errors_of(bus, language) + doubts_of(bus, options);
}

}  // namespace

std::string summary_text(const DecodeSummary& summary, const DecodeOptions& options) {
  std::string text;
  bool latencies = false;
  for (const auto& [interface, bus] : summary.buses) {
    text += bus_text(interface, bus, options);
    for (const auto& [key, command] : bus.commands) latencies |= command.latency.count() > 0;
  }
  if (latencies) {
    text += say({"\nLatencies are from stamp to stamp; median and p99 are right to 1.6 %.\n",
                 "\n延迟为两个时间戳之差；中位数和 p99 的误差不超过 1.6 %。\n"},
                options.language);
  }
  if (summary.bad_lines > 0) {
    text += say({"\nLines that are not frames: {}\n", "\n不是帧的行：{}\n"}, options.language,
                summary.bad_lines);
  }
  return text;
}

}  // namespace lk::emulator
