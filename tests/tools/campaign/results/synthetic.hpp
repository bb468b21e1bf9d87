#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "tools/campaign/results/case_result.hpp"

namespace lk::test {

inline constexpr std::array kKinds = {"jam", "drop", "offset", "silence", "late", "corrupt"};
inline constexpr std::array kStates = {"off", "stopped", "running"};
inline constexpr std::array kCommands = {"none", "A1", "A2", "A4", "9C"};

/// A campaign whose results nobody ran: every kind of column, and texts that need care.
inline emulator::CampaignHead synthetic_head(std::uint64_t numbers) {
  emulator::CampaignHead head;
  head.version = "0.2.0";
  head.plan_name = "every_fault";
  head.about = "A joint under every kind of fault";
  head.plan_text = "about = \"A joint under every kind of fault\"\n";
  head.input_hash = "8c1f";
  head.sampling = emulator::Sampling::kRandom;
  head.seed = 0xfedc'ba98'7654'3210;  // above the largest integer of SQLite
  head.numbers = numbers;
  head.cases = numbers;
  head.tolerant_time = std::chrono::milliseconds(200);
  head.dimensions.resize(5);
  head.dimensions[0] = {.name = "fault.kind", .words = {kKinds.begin(), kKinds.end()}};
  head.dimensions[1] = {.name = "fault.at_s", .words = {}, .from = 0.5, .to = 3};
  head.dimensions[2] = {.name = "fault.for_s", .words = {}, .from = 0.1, .to = 0.5};
  head.dimensions[3] = {
      .name = "fault.jam.percent", .words = {}, .from = 10, .to = 100, .least_is_to = true};
  head.dimensions[4] = {.name = "generation", .words = {"gen1", "gen2"}};
  return head;
}

/// Of the number alone.
inline emulator::CaseResult synthetic_case(std::uint64_t number) {
  std::mt19937_64 draw(number);
  const auto one_of = [&](auto& list) { return std::string(list[draw() % list.size()]); };
  const auto ms = [&](std::uint64_t below) {
    return emulator::SimTime(std::chrono::milliseconds(draw() % below));
  };
  emulator::CaseResult result;
  result.number = number;
  const std::string kind = one_of(kKinds);
  const emulator::SimTime at = std::chrono::milliseconds(500) + ms(2500);
  result.values = {kind, std::chrono::duration<double>(at).count(),
                   static_cast<double>(100 + draw() % 400) / 1000, std::nullopt, "gen2"};
  if (kind == "jam") result.values[3] = static_cast<double>(1000 + draw() % 9000) / 100;
  result.outcome = static_cast<emulator::CaseOutcome>(draw() % emulator::kCaseOutcomes);
  result.fault_at = at;
  if (result.outcome == emulator::CaseOutcome::kNotFired) return result;
  result.first_effect_at = at + ms(50) + emulator::SimTime(draw() % 1'000'000);
  if (draw() % 2 == 0) result.detected_by_drive = *result.first_effect_at + ms(300);
  if (draw() % 4 == 0) result.detected_by_host = *result.first_effect_at + ms(300);
  if (draw() % 4 == 0) {
    result.violated_at = *result.first_effect_at + ms(300);
    result.violated = "the forearm stands still in the jam";
  }
  if (draw() % 8 != 0) result.margin = static_cast<double>(draw() % 20000) / 1e4 - 1;
  result.state = one_of(kStates);
  result.command = one_of(kCommands);
  if (draw() % 64 == 0) result.note = "exit status 3, \"drive 1\"\nlost";
  result.wall_s = static_cast<double>(draw() % 50'000) / 1e6;
  return result;
}

inline std::vector<emulator::CaseResult> synthetic_cases(std::uint64_t from, std::uint64_t to) {
  std::vector<emulator::CaseResult> cases;
  for (std::uint64_t number = from; number < to; ++number) cases.push_back(synthetic_case(number));
  return cases;
}

}  // namespace lk::test
