#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "tools/guess/evidence.hpp"

namespace lk::emulator {

/// How well a generation of firmware fits the evidence about a drive.
struct GenerationFit {
  Generation generation = Generation::kLegacy;
  std::vector<Trait> against;  // traits that contradict the evidence
  std::uint64_t frames_for = 0;
  std::uint64_t frames_against = 0;
};

struct QuirkOption {
  std::string_view key;
  std::string_view value;

  friend bool operator==(const QuirkOption&, const QuirkOption&) = default;
};

/// Conclusion about a drive from the evidence.
struct Guess {
  std::vector<GenerationFit> generations;    // all of them, from old to new
  std::vector<Generation> fits;              // the generations without contradictions
  Generation nearest = Generation::kLegacy;  // first that fits; if none, fewest contradictions
  std::vector<QuirkOption> quirks;           // where the drive differs from `nearest`
  std::string_view encoder_span;             // quirk of no generation; empty: unknown
  std::string_view encoder_bits;  // unlike an MF drive of `nearest`; empty: alike, or unknown
  protocol::Framing framing = protocol::Framing::kCan;
  bool ms = false;    // true: the drive is surely of the MS series
  std::string motor;  // by the label in the drive's product info; empty: unknown
  std::vector<Trait> decided;
  std::vector<Trait> unknown;        // logs can show these traits, but this log does not
  std::vector<Trait> contradictory;  // frames about these traits contradict each other
  bool foreign = false;              // true: no LK drive replies with these identifiers

  /// Returns `quirks`, `encoder_span` and `encoder_bits` if known.
  std::vector<QuirkOption> all_quirks() const;
  /// Returns text like "--generation v235 --quirk single_turn_bits=16".
  std::string options() const;
};

/// Motor for commands that emulate an MS drive, because frames do not show which motor it has.
inline constexpr std::string_view kMsStandIn = "ms4010";

Guess guess_of(const Evidence& evidence);
/// Returns the names of the values that `trait` may have: "centivolt", "centivolt_and_bus_current".
std::vector<std::string_view> possible_value_names(Trait trait, const Evidence& evidence);
/// Returns the unknown traits that differ between the generations that fit. If none fits, between
/// the nearest ones.
std::vector<Trait> telling(const Guess& guess);

}  // namespace lk::emulator
