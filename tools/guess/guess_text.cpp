#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <map>
#include <set>
#include <utility>

#include "emulator/core/frame_text.hpp"
#include "emulator/core/generation.hpp"
#include "tools/guess/guess_output.hpp"

namespace lk::emulator {
namespace {

constexpr std::size_t kLongestName = 15;  // IFNAMSIZ - 1

template <class... Args>
std::string say(const BilingualText& words, Language language, const Args&... args) {
  return fmt::format(fmt::runtime(words.in(language)), args...);
}

/// Returns text like "v235, v236".
std::string names(const std::vector<Generation>& generations, std::string_view separator) {
  std::vector<std::string_view> all;
  for (const Generation one : generations) all.push_back(generation_name(one));
  return fmt::format("{}", fmt::join(all, separator));
}

std::string key_list(const std::vector<Trait>& traits) {
  std::vector<std::string_view> all;
  for (const Trait trait : traits) {
    if (!row_of(trait).key.empty()) all.push_back(row_of(trait).key);
  }
  return fmt::format("{}", fmt::join(all, ", "));
}

/// Returns text like "1-3,7".
std::string id_list(const std::vector<int>& ids) {
  std::string text;
  for (std::size_t n = 0; n < ids.size(); ++n) {
    std::size_t last = n;
    while (last + 1 < ids.size() && ids[last + 1] == ids[last] + 1) ++last;
    text += text.empty() ? "" : ",";
    text += std::to_string(ids[n]);
    if (last > n) text += (last > n + 1 ? "-" : ",") + std::to_string(ids[last]);
    n = last;
  }
  return text;
}

std::string sighting_line(const Sighting& sighting, std::optional<SimTime> begin) {
  const std::string at =
      sighting.at && begin ? fmt::format("{:12.6f}  ", in_seconds(*sighting.at - *begin)) : "";
  return "      " + at + frame_text(sighting.frame) + "\n";
}

/// Describes a known trait, with examples of frames.
std::string finding(Trait trait, const Evidence& evidence, std::optional<SimTime> begin,
                    Language language) {
  const TraitRow& row = row_of(trait);
  std::string text = "    ";
  if (!row.key.empty()) {
    const std::string between = say({" or ", " 或 "}, language);
    text += fmt::format("{} = {}: ", row.key,
                        fmt::join(possible_value_names(trait, evidence), between));
  }
  std::uint64_t frames_for = 0;
  std::uint64_t frames_against = 0;
  std::vector<Sighting> examples;
  std::string meaning;
  for (std::size_t value = 0; value < row.count; ++value) {
    if (!contains(evidence.open(trait), value)) continue;
    meaning += meaning.empty() ? "" : BilingualText{"; or ", "；或 "}.in(language);
    meaning += row.meanings.at(value).in(language);
    if (evidence.frames_for(trait, value) <= frames_for) continue;
    frames_for = evidence.frames_for(trait, value);
    frames_against = evidence.frames_against(trait, value);
    examples = evidence.examples(trait, value);
  }
  text += meaning + say({" (frames for it: {}, against: {})\n", "（支持的帧：{}，反对的帧：{}）\n"},
                        language, frames_for, frames_against);
  for (const Sighting& one : examples) text += sighting_line(one, begin);
  return text;
}

std::string contradiction(Trait trait, const Evidence& evidence, std::optional<SimTime> begin,
                          Language language) {
  const TraitRow& row = row_of(trait);
  std::string text = say({"    {}: frames contradict each other; two drives with this ID, or one "
                          "that was exchanged?\n",
                          "    {}：帧互相矛盾；有两个驱动器用此 ID，或更换过驱动器？\n"},
                         language, row.key.empty() ? "MS" : row.key);
  for (std::size_t value = 0; value < row.count; ++value) {
    for (const Sighting& one : evidence.examples(trait, value)) text += sighting_line(one, begin);
  }
  return text;
}

std::string generation_lines(const Guess& guess, Language language) {
  std::string text;
  for (const GenerationFit& fit : guess.generations) {
    const bool fits = fit.against.empty();
    text += say({"    {:<12} {} (frames for it: {}, against: {})\n",
                 "    {:<12} {}（支持的帧：{}，反对的帧：{}）\n"},
                language, generation_name(fit.generation),
                fits ? say({"fits", "符合"}, language)
                     : say({"does not fit: {}", "不符：{}"}, language, key_list(fit.against)),
                fit.frames_for, fit.frames_against);
  }
  return text;
}

std::string summary_of(const Guess& guess, Language language) {
  if (guess.foreign) {
    return say(
        {"replies on 0x240 + ID: not an LK-TECH drive; MyActuator drives from V3 on do that, "
         "and are not "
         "emulated",
         "回复帧标识符为 0x240 + ID：不是瓴控驱动器；MyActuator V3 起如此，本仿真器不支持"},
        language);
  }
  if (guess.fits.empty()) {
    return say({"a mixture, nearest to {}", "混合型，最接近 {}"}, language,
               generation_name(guess.nearest));
  }
  if (guess.fits.size() == guess.generations.size()) {
    return say({"nothing in the log tells the generations apart", "日志里没有能分辨固件代的内容"},
               language);
  }
  return names(guess.fits, say({" or ", " 或 "}, language));
}

/// Describes the query to send or the event to wait for, so that a log shows the trait.
std::string probe_line(Trait trait, int drive, protocol::Framing framing, Language language) {
  const TraitRow& row = row_of(trait);
  if (!has_probe(trait, framing)) {
    return say({"    to distinguish them: {} ({})\n", "    要分辨它们：{}（{}）\n"}, language,
               row.how.in(language), row.key);
  }
  const BilingualText words = row.how.en.empty()
                                  ? BilingualText{"    to distinguish them, send: {} ({})\n",
                                                  "    要分辨它们，请发送：{}（{}）\n"}
                                  : BilingualText{"    to distinguish them, send: {} ({}; {})\n",
                                                  "    要分辨它们，请发送：{}（{}；{}）\n"};
  return say(words, language, probe_text(trait, drive, framing), row.key, row.how.in(language));
}

/// Lists the unknown traits: first those that separate the possible generations, then the others.
std::string unknown_lines(const Guess& guess, int drive, Language language) {
  std::string text;
  const std::vector<Trait> apart = telling(guess);
  for (const Trait trait : apart) text += probe_line(trait, drive, guess.framing, language);
  std::vector<Trait> others;
  for (const Trait trait : guess.unknown) {
    if (std::ranges::count(apart, trait) + std::ranges::count(guess.decided, trait) == 0) {
      others.push_back(trait);
    }
  }
  const std::string rest = key_list(others);
  return rest.empty() ? text
                      : text + say({"    the log does not show: {}\n", "    日志里看不出：{}\n"},
                                   language, rest);
}

/// Lists observations that LK-TECH drives do not cause.
std::string oddities(const DriveWatch& drive, Language language) {
  std::string text;
  if (drive.odd_currents() > 0) {
    text += say({"    iq beyond ±2048 (replies: {}): LK-TECH drives do not have it; MyActuator's "
                 "count 0.01 A\n",
                 "    转矩电流超过 ±2048（回复帧：{}）：瓴控驱动器没有；MyActuator 以 0.01 A 计\n"},
                language, drive.odd_currents());
  }
  if (drive.odd_states() > 0 && drive.evidence().open(Trait::kState1) == all_of(Trait::kState1)) {
    text += say({"    0x9A and 0x9B without a layout of LK-TECH (replies: {}); MyActuator's newer "
                 "drives have the voltage at [4:5]\n",
                 "    0x9A、0x9B 不是瓴控的布局（回复帧：{}）；较新的 MyActuator 驱动器电压在 "
                 "[4:5]\n"},
                language, drive.odd_states());
  }
  return text;
}

/// Describes the width of the encoder field and its counts per turn.
std::string encoder_text(const DriveWatch& drive, Language language) {
  const EncoderWatch& encoder = drive.encoder();
  if (!encoder.largest()) return "";
  std::string text = say({"; encoder up to {}: {} bits or more", "；编码器最大 {}：至少 {} 位"},
                         language, *encoder.largest(), std::bit_width(*encoder.largest()));
  if (const auto counts = encoder.counts_per_turn()) {
    text +=
        say({", {:.0f} counts per 360° of 0x92", "，0x92 每 360° 为 {:.0f}"}, language, *counts);
  }
  return text;
}

/// Returns the conclusion in one line: "can0, drive 1: v235; calls itself MS4015 …".
std::string conclusion(const std::string& interface, int id, const DriveWatch& drive,
                       Language language) {
  std::string text = say({"{}, drive {}: ", "{}，驱动器 {}："}, language, interface, id);
  if (drive.replies() == 0) {
    text += say({"no reply: no conclusion possible", "没有回复：无法判断"}, language);
  } else {
    const Evidence& evidence = drive.evidence();
    text += summary_of(guess_of(evidence), language);
    if (const auto& product = evidence.product()) {
      text +=
          say({"; calls itself {} with driver {}, firmware {}", "；自称 {}，驱动板 {}，固件 {}"},
              language, product->motor, product->driver, product->firmware);
    }
    text += encoder_text(drive, language);
  }
  return text + say({" (queries: {}, replies: {})\n", "（命令帧：{}，回复帧：{}）\n"}, language,
                    drive.queries(), drive.replies());
}

std::string drive_text(int id, const DriveWatch& drive, std::optional<SimTime> begin,
                       Language language) {
  if (drive.replies() == 0) return "";
  std::string text = say({"\n  drive {}:\n", "\n  驱动器 {}：\n"}, language, id);
  const Evidence& evidence = drive.evidence();
  const Guess guess = guess_of(evidence);
  if (!guess.foreign) text += generation_lines(guess, language);
  for (const Trait trait : guess.decided) text += finding(trait, evidence, begin, language);
  for (const Trait trait : guess.contradictory) {
    text += contradiction(trait, evidence, begin, language);
  }
  if (guess.foreign) return text;
  return text + oddities(drive, language) + unknown_lines(guess, id, language);
}

// --- commands that emulate the drives

/// Returns true for a virtual bus whose name is safe in a shell and in a file.
bool is_virtual(std::string_view name) {
  for (const std::string_view prefix : {"vcan", "vxcan"}) {
    if (!name.starts_with(prefix) || name.size() > kLongestName) continue;
    const std::string_view number = name.substr(prefix.size());
    if (!number.empty() && number.find_first_not_of("0123456789") == std::string_view::npos) {
      return true;
    }
  }
  return false;
}

/// Replaces the bus names of a log by names of virtual buses, so that a copied command line does
/// not start drives on a real bus.
class BusNames {
 public:
  explicit BusNames(const Guesser& guesser) {
    for (const auto& [wire, bus] : guesser.buses()) {
      if (is_virtual(wire.first)) taken_.insert(wire.first);
    }
  }
  std::string name_for(const std::string& interface, protocol::Framing framing) {
    if (framing == protocol::Framing::kSerial) {
      const std::string name = "rs485:/tmp/arm" + (arms_ > 0 ? std::to_string(arms_) : "");
      ++arms_;
      return name;
    }
    if (is_virtual(interface)) return interface;
    int number = 0;
    while (!taken_.insert("vcan" + std::to_string(number)).second) ++number;
    return "vcan" + std::to_string(number);
  }

 private:
  std::set<std::string> taken_;
  int arms_ = 0;
};

/// Drives of a bus with the same options.
struct Kind {
  Guess guess;  // of the first drive, but `fits` has only generations that fit all drives
  std::vector<int> ids;
};

/// Groups the drives of a bus by their options.
std::map<std::string, Kind> kinds_of(const Guesser& guesser, const GuessedBus& bus) {
  std::map<std::string, Kind> kinds;
  for (const auto& [id, drive] : bus.drives) {
    if (drive.replies() == 0) continue;
    const Guess guess = guesser.guess(drive);
    if (guess.foreign) continue;
    Kind& kind = kinds.try_emplace(guess.options(), Kind{guess, {}}).first->second;
    kind.ids.push_back(id);
    std::erase_if(kind.guess.fits,
                  [&guess](Generation one) { return std::ranges::count(guess.fits, one) == 0; });
  }
  return kinds;
}

/// Lists what a command line assumes without proof.
std::vector<std::string> doubts(const Guess& guess, Language language) {
  std::vector<std::string> notes;
  if (guess.framing == protocol::Framing::kSerial) {
    notes.push_back(say(
        {"the log does not show the bit rate: --baud", "日志里看不出波特率：--baud"}, language));
  }
  if (guess.fits.size() == guess.generations.size()) {
    notes.push_back(say({"nothing in the log tells the generation: {} is the default",
                         "日志里看不出固件代：{} 是默认值"},
                        language, generation_name(guess.nearest)));
  } else if (guess.fits.size() > 1) {
    const std::vector<Generation> others(guess.fits.begin() + 1, guess.fits.end());
    notes.push_back(say({"or generation {}", "或固件代 {}"}, language,
                        names(others, say({" or ", " 或 "}, language))));
  }
  if (guess.ms && guess.motor.empty()) {
    notes.push_back(say({"{} is a stand-in: the log does not show which MS motor it is",
                         "{} 只是代替：日志里看不出是哪种 MS 电机"},
                        language, kMsStandIn));
  }
  return notes;
}

/// Returns the value of a quirk as TOML: words in quotes; true, 16 and 0x180 without.
std::string toml_value(std::string_view value) {
  const bool bare = value == "true" || value == "false" ||
                    std::isdigit(static_cast<unsigned char>(value.front())) != 0;
  return bare ? std::string(value) : fmt::format("\"{}\"", value);
}

std::string toml_drive(const Kind& kind, Language language) {
  std::string text = fmt::format("\n[[bus.drive]]\nids = \"{}\"\n", id_list(kind.ids));
  for (const std::string& note : doubts(kind.guess, language)) text += "# " + note + "\n";
  const std::string_view motor = !kind.guess.motor.empty() ? kind.guess.motor
                                 : kind.guess.ms           ? kMsStandIn
                                                           : "";
  if (!motor.empty()) text += fmt::format("motor = \"{}\"\n", motor);
  text += fmt::format("generation = \"{}\"\n", generation_name(kind.guess.nearest));
  std::vector<std::string> quirks;
  for (const QuirkOption& one : kind.guess.all_quirks()) {
    quirks.push_back(fmt::format("{} = {}", one.key, toml_value(one.value)));
  }
  if (!quirks.empty()) text += fmt::format("quirks = {{ {} }}\n", fmt::join(quirks, ", "));
  return text;
}

std::string starts_text(const Starts& starts, Language language) {
  std::string text;
  if (!starts.commands.empty()) {
    text += say({"To emulate them (--motor takes the motor by its label):\n",
                 "仿真它们（--motor 给出电机型号）：\n"},
                language);
  }
  for (const StartCommand& command : starts.commands) {
    text += "  " + command.line + "\n";
    for (const std::string& doubt : command.doubts) text += "    " + doubt + "\n";
  }
  if (starts.robot.empty()) return text;
  return text +
         say({"As robot.toml, for lk-emu --config ./robot.toml (motor = takes the motor by its "
              "label):\n\n",
              "存为 robot.toml，用 lk-emu --config ./robot.toml 启动（motor = "
              "给出电机型号）：\n\n"},
             language) +
         starts.robot;
}

std::string left_out(const Guesser& guesser, Language language) {
  std::string text;
  if (guesser.bad_lines() > 0) {
    text +=
        say({"Lines that are not frames: {}\n", "不是帧的行：{}\n"}, language, guesser.bad_lines());
  }
  if (guesser.unread_frames() > 0) {
    text += say({"Frames of further interfaces, not read (max {}): {}\n",
                 "更多接口的帧，未读取（最多 {} 个接口）：{}\n"},
                language, Guesser::kMaxInterfaces, guesser.unread_frames());
  }
  return text;
}

}  // namespace

Starts starts_of(const Guesser& guesser, Language language) {
  Starts starts;
  BusNames bus_names(guesser);
  for (const auto& [wire, bus] : guesser.buses()) {
    const std::map<std::string, Kind> kinds = kinds_of(guesser, bus);
    if (kinds.empty()) continue;
    const std::string name = bus_names.name_for(wire.first, wire.second);
    if (kinds.size() == 1) {
      const auto& [options, kind] = *kinds.begin();
      starts.commands.push_back(
          {fmt::format("lk-emu --bus {} --ids {} {}", name, id_list(kind.ids), options),
           doubts(kind.guess, language)});
      continue;
    }
    if (!starts.robot.empty()) starts.robot += "\n";
    starts.robot += fmt::format("[[bus]]\ninterface = \"{}\"\n", name);
    for (const auto& [options, kind] : kinds) starts.robot += toml_drive(kind, language);
  }
  return starts;
}

std::string guess_text(const Guesser& guesser, Language language) {
  std::string text;
  bool any = false;
  for (const auto& [wire, bus] : guesser.buses()) {
    for (const auto& [id, drive] : bus.drives) {
      text += conclusion(wire.first, id, drive, language);
      any = true;
    }
  }
  if (any) text += "\n";
  for (const auto& [wire, bus] : guesser.buses()) {
    const BilingualText frames = bus.frames == 1 ? BilingualText{"{}: {} frame", "{}：{} 帧"}
                                                 : BilingualText{"{}: {} frames", "{}：{} 帧"};
    text += say(frames, language, wire.first, bus.frames);
    if (bus.others > 0)
      text += say({", {} of no drive", "，其中 {} 帧不属于驱动器"}, language, bus.others);
    text += "\n";
    for (const auto& [id, drive] : bus.drives) {
      text += drive_text(id, drive, guesser.begin(), language);
    }
    if (bus.drives.empty()) {
      text += say({"  no drive's frames\n", "  没有驱动器的帧\n"}, language);
    }
    text += "\n";
  }
  if (any) {
    text += say({"Never visible in frames: {}.\n", "帧里永远看不出：{}。\n"}, language,
                fmt::format("{}", fmt::join(kNeverShown, ", ")));
  }
  return text + left_out(guesser, language) + starts_text(starts_of(guesser, language), language);
}

}  // namespace lk::emulator
