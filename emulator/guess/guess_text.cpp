#include "emulator/guess/guess_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <utility>

#include "emulator/core/frame_text.hpp"
#include "emulator/core/generation.hpp"

namespace lk::emulator {
namespace {

template <class... Args>
std::string say(const Words& words, Language language, const Args&... args) {
  return fmt::format(fmt::runtime(words.in(language)), args...);
}

/// "v235, v236"
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

/// "1-3,7"
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
      sighting.at && begin
          ? fmt::format("{:12.6f}  ", std::chrono::duration<double>(*sighting.at - *begin).count())
          : "";
  return "      " + at + frame_text(sighting.frame) + "\n";
}

/// A trait of which something is known, and the frames that say so.
std::string finding(Trait trait, const Evidence& evidence, std::optional<SimTime> begin,
                    Language language) {
  const TraitRow& row = row_of(trait);
  std::string text = "    ";
  if (!row.key.empty()) {
    const std::string between(Words{" or ", " 或 "}.in(language));
    text += fmt::format("{} = {}: ", row.key, fmt::join(open_values(trait, evidence), between));
  }
  std::uint64_t frames_for = 0;
  std::uint64_t frames_against = 0;
  std::vector<Sighting> examples;
  std::string meaning;
  for (std::size_t value = 0; value < row.count; ++value) {
    if (!contains(evidence.open(trait), value)) continue;
    meaning += meaning.empty() ? "" : Words{"; or ", "；或 "}.in(language);
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
                fits ? std::string(Words{"fits", "符合"}.in(language))
                     : say({"does not fit: {}", "不符：{}"}, language, key_list(fit.against)),
                fit.frames_for, fit.frames_against);
  }
  return text;
}

std::string summary_of(const Guess& guess, Language language) {
  if (guess.foreign) {
    return std::string(
        Words{"replies on 0x240 + ID: not an LK-TECH drive; MyActuator drives from V3 on do that, "
              "and are not "
              "emulated",
              "回复帧标识符为 0x240 + ID：不是瓴控驱动器；MyActuator V3 起如此，本仿真器不支持"}
            .in(language));
  }
  if (guess.fits.empty()) {
    return say({"a mixture, nearest to {}", "混合型，最接近 {}"}, language,
               generation_name(guess.nearest));
  }
  if (guess.fits.size() == guess.generations.size()) {
    return std::string(
        Words{"nothing in the log tells the generations apart", "日志里没有能分辨固件代的内容"}.in(
            language));
  }
  return names(guess.fits, Words{" or ", " 或 "}.in(language));
}

/// What to send to know more: first what tells the generations that fit apart.
std::string unknown_lines(const Guess& guess, int drive, Language language) {
  std::string text;
  std::vector<Trait> others;
  const std::vector<Trait> apart = telling(guess);
  for (const Trait trait : apart) {
    const TraitRow& row = row_of(trait);
    if (row.probe.empty()) {
      others.push_back(trait);
      continue;
    }
    const Words words =
        row.how.en.empty()
            ? Words{"    to tell them apart: {} ({})\n", "    可以分辨：{}（{}）\n"}
            : Words{"    to tell them apart: {} ({}; {})\n", "    可以分辨：{}（{}；{}）\n"};
    text += say(words, language, probe_text(trait, drive), row.key, row.how.in(language));
  }
  for (const Trait trait : guess.unknown) {
    if (std::ranges::find(apart, trait) == apart.end()) others.push_back(trait);
  }
  const std::string rest = key_list(others);
  return rest.empty() ? text
                      : text + say({"    not told: {}\n", "    看不出：{}\n"}, language, rest);
}

std::string drive_text(int id, const DriveWatch& drive, std::optional<SimTime> begin,
                       Language language) {
  std::string text = say({"\n  drive {}: ", "\n  驱动器 {}："}, language, id);
  if (drive.replies() == 0) {
    return text + say({"no reply to {} queries, so nothing can be told of it\n",
                       "{} 个命令帧都没有回复，无法判断\n"},
                      language, drive.queries());
  }
  const Evidence& evidence = drive.evidence();
  const Guess guess = guess_of(evidence);
  text += summary_of(guess, language) +
          say({" (queries: {}, replies: {})\n", "（命令帧：{}，回复帧：{}）\n"}, language,
              drive.queries(), drive.replies());
  if (!guess.foreign) text += generation_lines(guess, language);
  for (const Trait trait : guess.decided) text += finding(trait, evidence, begin, language);
  for (const Trait trait : guess.contradictory) {
    text += contradiction(trait, evidence, begin, language);
  }
  if (drive.odd_currents() > 0) {
    text += say({"    iq beyond ±2048 in {} replies: LK-TECH drives do not have it; MyActuator's "
                 "count 0.01 A\n",
                 "    {} 个回复帧的转矩电流超过 ±2048：瓴控驱动器没有；MyActuator 以 0.01 A 计\n"},
                language, drive.odd_currents());
  }
  if (drive.odd_states() > 0 && evidence.open(Trait::kState1) == all_of(Trait::kState1)) {
    text +=
        say({"    0x9A and 0x9B in {} replies have no layout of LK-TECH; MyActuator's newer drives "
             "have the "
             "voltage at [4:5]\n",
             "    {} 个 0x9A、0x9B 回复帧不是瓴控的布局；较新的 MyActuator 驱动器电压在 [4:5]\n"},
            language, drive.odd_states());
  }
  return text + (guess.foreign ? "" : unknown_lines(guess, id, language));
}

/// A name for a virtual bus: a real one's would be started on by whoever copies the line.
std::string virtual_name(const std::string& interface, std::size_t place) {
  const bool is_virtual = interface.starts_with("vcan") || interface.starts_with("vxcan");
  return is_virtual ? interface : "vcan" + std::to_string(place);
}

}  // namespace

std::vector<std::string_view> open_values(Trait trait, const Evidence& evidence) {
  std::vector<std::string_view> values;
  for (std::size_t value = 0; value < row_of(trait).count; ++value) {
    if (contains(evidence.open(trait), value)) values.push_back(row_of(trait).values.at(value));
  }
  return values;
}

std::string probe_text(Trait trait, int drive) {
  const std::string_view data = row_of(trait).probe;
  if (data.empty()) return "";
  return fmt::format("{:03X}#{}", protocol::kSingleDriveId + static_cast<unsigned>(drive), data);
}

std::vector<Trait> telling(const Guess& guess) {
  std::vector<Trait> traits;
  for (const Trait trait : guess.unknown) {
    const auto of = row_of(trait).of;
    if (of == nullptr || guess.fits.empty()) continue;
    const std::size_t first = of(quirks_of(guess.fits.front()));
    const bool same = std::ranges::all_of(guess.fits, [of, first](Generation generation) {
      return of(quirks_of(generation)) == first;
    });
    if (!same) traits.push_back(trait);
  }
  // A query is easier to send than something to wait for.
  std::stable_partition(traits.begin(), traits.end(),
                        [](Trait trait) { return !row_of(trait).probe.empty(); });
  return traits;
}

std::vector<std::string> command_lines(const Guesser& guesser) {
  std::vector<std::string> lines;
  std::size_t place = 0;
  for (const auto& [interface, bus] : guesser.buses()) {
    std::map<std::string, std::vector<int>> kinds;
    for (const auto& [id, drive] : bus.drives) {
      if (drive.replies() == 0) continue;
      const Guess guess = guess_of(drive.evidence());
      if (!guess.foreign) kinds[guess.options()].push_back(id);
    }
    for (const auto& [options, ids] : kinds) {
      lines.push_back(fmt::format("lk-emu --bus {} --ids {} {}", virtual_name(interface, place),
                                  id_list(ids), options));
    }
    if (!kinds.empty()) ++place;
  }
  return lines;
}

std::string guess_text(const Guesser& guesser, Language language) {
  std::string text;
  bool any = false;
  for (const auto& [interface, bus] : guesser.buses()) {
    text += say({"{}: {} frames", "{}：{} 帧"}, language, interface, bus.frames);
    if (bus.others > 0)
      text += say({", {} of no drive", "，其中 {} 帧不属于驱动器"}, language, bus.others);
    text += "\n";
    for (const auto& [id, drive] : bus.drives) {
      text += drive_text(id, drive, guesser.begin(), language);
      any = true;
    }
    if (bus.drives.empty()) {
      text += Words{"  no drive's frames\n", "  没有驱动器的帧\n"}.in(language);
    }
    text += "\n";
  }
  if (any) {
    text += say({"Bytes never tell: {}.\n", "字节本身永远看不出：{}。\n"}, language,
                fmt::format("{}", fmt::join(kNeverShown, ", ")));
  }
  const auto lines = command_lines(guesser);
  if (!lines.empty()) {
    text += Words{"To emulate them (--motor takes the motor by its label):\n",
                  "仿真它们（--motor 给出电机型号）：\n"}
                .in(language);
    for (const std::string& line : lines) text += "  " + line + "\n";
  }
  if (guesser.bad_lines() > 0) {
    text +=
        say({"Lines that are no frames: {}\n", "不是帧的行：{}\n"}, language, guesser.bad_lines());
  }
  return text;
}

}  // namespace lk::emulator
