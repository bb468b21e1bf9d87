#include <cmath>

#include "emulator/core/frame_text.hpp"
#include "emulator/core/generation.hpp"
#include "emulator/monitor/frames/decode_words.hpp"
#include "tools/decode/decode_output.hpp"

namespace lk::emulator {
namespace {

constexpr const char* kDim = "2";
constexpr const char* kRed = "1;31";
constexpr const char* kGreen = "32";
constexpr const char* kYellow = "33";
constexpr const char* kCyan = "36";

std::string paint(const std::string& text, const char* colour, const DecodeOptions& options) {
  if (!options.colour || text.empty()) return text;
  return fmt::format("\x1b[{}m{}\x1b[0m", colour, text);
}

std::string milliseconds(SimTime latency) {
  return fmt::format("{:.3f} ms", static_cast<double>(latency.count()) / 1e6);
}

std::string since_text(SimTime since) {
  const auto us = std::chrono::floor<std::chrono::microseconds>(since).count();
  const auto size = std::abs(us);
  return fmt::format("{}{}.{:06}", us < 0 ? "-" : "", size / 1'000'000, size % 1'000'000);
}

struct RoleWords {
  BilingualText words;
  const char* colour;
};

RoleWords role_words(const FrameInfo& info) {
  switch (info.role) {
    case Role::kQuery:
      return {{"query", "命令"}, kCyan};
    case Role::kReply:
      if (info.sure) return {{"reply", "回复"}, kGreen};
      return {{"reply?", "回复？"}, kGreen};
    case Role::kUnclear:
      return {{"?", "？"}, kYellow};
    case Role::kOther:
      break;
  }
  return {{"", ""}, kYellow};
}

/// Returns a remark about the frame, to print after its contents.
std::string remark(const DecodedFrame& frame, Language language) {
  if (!frame.words.problem.empty()) {
    std::string text(in_language(frame.words.problem, language));
    if (frame.frame.kind == protocol::FrameKind::kError) {
      const std::string about = listed(error_frame_words(frame.frame.id), language);
      if (!about.empty()) text += say({": {}", "：{}"}, language, about);
    }
    return text;
  }
  if (frame.info.role == Role::kUnclear) {
    return say({"query or reply?", "命令帧还是回复帧？"}, language);
  }
  if (frame.info.role != Role::kReply) return "";
  if (frame.info.match_count == 0) {
    return say({"no query for it", "没有对应的命令帧"}, language);
  }
  if (frame.info.match_count == 1) return "";
  return say({"to one of {} queries", "对应 {} 个命令帧之一"}, language, frame.info.match_count);
}

std::string drive_text(const DecodedFrame& frame) {
  if (frame.info.drive > 0) return std::to_string(frame.info.drive);
  return frame.info.role == Role::kQuery ? "1-4" : "";
}

}  // namespace

std::string frame_line(const DecodedFrame& frame, const DecodeOptions& options) {
  const Language language = options.language;
  const RoleWords role = role_words(frame.info);
  const bool error = frame.words.mark == "error";
  std::string line;
  if (frame.since) line += paint(right(since_text(*frame.since), 12), kDim, options) + "  ";
  line += padded(frame.interface, 6) + " " + right(drive_text(frame), 3) + "  ";
  line += paint(padded(role.words.in(language), 6), role.colour, options) + " ";
  line += right(frame.info.latency ? milliseconds(*frame.info.latency) : "", 10) + "  ";
  const bool named = frame.info.role != Role::kOther && !frame.words.name.empty();
  const std::string name =
      named ? frame.words.command + " " + std::string(in_language(frame.words.name, language))
            : frame_text(frame.frame);
  line += paint(padded(name, 28), error ? kRed : role.colour, options) + "  ";
  const std::string quantities =
      quantities_text(frame.words.quantities, frame.info.query_code, language);
  line += error ? paint(quantities, kRed, options) : quantities;
  const std::string beside = remark(frame, language);
  if (!beside.empty()) {
    line += quantities.empty() ? "" : "  ";
    line += paint(say({"({})", "（{}）"}, language, beside), error ? kRed : kYellow, options);
  }
  line.erase(line.find_last_not_of(' ') + 1);
  return line + "\n";
}

std::string note_line(const BilingualText& words, const DecodeOptions& options) {
  return paint("# " + std::string(words.in(options.language)), kDim, options) + "\n";
}

std::string assumption_line(const DecodeOptions& options, protocol::Framing framing) {
  if (!options.buses.empty() || (options.generation_given && options.motor_given)) return "";
  const Language language = options.language;
  const auto format =
      protocol::wire_format(quirks_of(options.generation, framing).dialect, options.profile.series);
  std::string text = say({"# assumed: ", "# 假定："}, language);
  if (!options.generation_given) {
    text += say({"firmware {} (--generation)", "固件代 {}（--generation）"}, language,
                generation_name(options.generation));
  }
  if (!options.generation_given && !options.motor_given) text += say({", ", "，"}, language);
  if (!options.motor_given) {
    text += say({"motor {} (--motor)", "电机 {}（--motor）"}, language, options.profile.name);
  }
  if (options.profile.series != Series::kMs) {
    text += say({"; a count of iq is {} mA in commands, {} mA in replies",
                 "；转矩电流每计数：命令 {} mA，回复 {} mA"},
                language, three_decimals(format.iq_command_lsb_A * 1000),
                three_decimals(format.iq_reply_lsb_A * 1000));
  }
  return paint(text, kDim, options) + "\n";
}

std::string bad_line(std::uint64_t line, const std::string& problem, const DecodeOptions& options) {
  const std::string text = say(
      {"# line {} is not a frame of candump, skipped: {}", "# 第 {} 行不是 candump 的帧，略过：{}"},
      options.language, line, problem);
  return paint(text, kYellow, options) + "\n";
}

}  // namespace lk::emulator
