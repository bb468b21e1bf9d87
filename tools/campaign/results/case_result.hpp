#pragma once

/// @file What came of one case of a campaign (docs/campaigns.md): plain values.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "emulator/core/sim_time.hpp"

namespace lk::emulator {

/// In the order of listings: from what does no harm to what does most.
enum class CaseOutcome : std::uint8_t {
  kNotFired,         // the fault never took effect: the case says nothing
  kNoEffect,         // it did, and hosts got what they get without it
  kTolerated,        // they got something else, and all that is expected held
  kDetectedByDrive,  // an error bit was set in time
  kDetectedByHost,   // the host noticed in time
  kLate,             // the one or the other, but too late
  kSilentlyWrong,    // something expected failed, and nobody noticed
  kHang,             // the host did not come to its end
  kCrash,            // the host died
};
inline constexpr std::size_t kCaseOutcomes = 9;
inline constexpr std::array<std::string_view, kCaseOutcomes> kCaseOutcomeWords = {
    "not fired",
    "no effect",
    "tolerated",
    "detected by the drive",
    "detected by the host",
    "late",
    "silently wrong",
    "hang",
    "crash"};
constexpr std::string_view to_string(CaseOutcome outcome) {
  return kCaseOutcomeWords[static_cast<std::size_t>(outcome)];
}

/// What a dimension has in a case: a number, or a word.
using CaseValue = std::variant<double, std::string>;
/// The shortest text that reads back to the same number, or the word.
std::string value_text(const CaseValue& value);

struct CaseResult {
  std::uint64_t number = 0;      // in its plan, for good
  std::uint32_t generation = 0;  // of `adaptive`, from 1; others have 0
  // By the plan's dimensions; nothing where the case has no such thing (a parameter of another
  // kind of fault).
  std::vector<std::optional<CaseValue>> values;
  CaseOutcome outcome = CaseOutcome::kNotFired;
  // Since the scenario began.
  std::optional<SimTime> fault_at;           // it began
  std::optional<SimTime> first_effect_at;    // something was otherwise than without it
  std::optional<SimTime> detected_by_drive;  // first error bit that would not have been set else
  std::optional<SimTime> detected_by_host;
  std::optional<SimTime> violated_at;  // the first hazardous expectation failed
  std::string violated;                // which, in words; empty: none
  // How far the worst of what is expected stood from failing: 0 at its limit, below 0 failed, 1 as
  // far as the width of its range. Nothing where no expectation has a measure.
  std::optional<double> margin;
  // Where it met the drive: for what of the space has been covered.
  std::string state;        // its run state, "running"
  std::string command;      // the latest command it had heard, "A4"; "none"
  std::string note;         // of the host: exit status, signal, which line told; or why invalid
  std::string said;         // the host's line that told, or its last; left out as wall_s is
  bool real_time = false;   // not to be had again to the bit
  std::uint32_t runs = 1;   // of a case in real time
  std::uint32_t flips = 0;  // runs of these with another outcome than the worst
  double wall_s = 0;        // left out of the canonical export
};

/// What is known of one dimension without the plan.
struct DimensionHead {
  std::string name;                // "fault.kind", "fault.jam.percent", "load.J_g_cm2"
  std::vector<std::string> words;  // what it may be; empty: a number
  double from = 0, to = 0;         // of numbers
  bool least_is_to = false;        // the harmless end
  friend bool operator==(const DimensionHead&, const DimensionHead&) = default;
};

enum class Sampling : std::uint8_t { kFull, kRandom, kLatin, kPairwise, kAdaptive };
inline constexpr std::array<std::string_view, 5> kSamplingWords = {"full", "random", "latin",
                                                                   "pairwise", "adaptive"};

/// What the plan was called on the command line. Whatever it is, the campaign is the same.
struct PlanCalled {
  std::string word;  // "plans/every_fault.toml", "every_fault"; empty: not known
  friend bool operator==(const PlanCalled&, const PlanCalled&) { return true; }
};

/// Which campaign results are of. All of a campaign's shards have the same.
struct CampaignHead {
  std::string version;     // of the program
  std::string plan_name;   // "every_fault"
  std::string about;       // a sentence
  std::string plan_text;   // the plan as it was read
  std::string input_hash;  // of the plan and all files that it names, hexadecimal
  Sampling sampling = Sampling::kFull;
  std::uint64_t seed = 1;
  std::uint64_t numbers = 0;             // cases are numbered from 0 to this - 1
  std::uint64_t cases = 0;               // of these, those that are not excluded; as far as known
  std::optional<SimTime> tolerant_time;  // the fault-tolerant time, from the first effect
  std::vector<DimensionHead> dimensions;
  PlanCalled plan_called;  // for commands that run its cases again: as a path was given
  friend bool operator==(const CampaignHead&, const CampaignHead&) = default;
};

/// Cases are counted one by one up to so many numbers.
inline constexpr std::uint64_t kMostCounted = 1'000'000;
/// How many cases of its plan a file does not have that has `count`. 0 too where nobody knows: of a
/// plan that excludes some of more than kMostCounted numbers.
std::uint64_t missing_cases(const CampaignHead& head, std::uint64_t count);

}  // namespace lk::emulator
