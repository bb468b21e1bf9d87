#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "tools/guess/evidence.hpp"

namespace lk::emulator {

/// Fit of a generation of firmware to the evidence about a drive.
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
  std::vector<Generation> fits;              // those without contradictions
  Generation nearest = Generation::kLegacy;  // first that fits, or with least contradictions
  std::vector<QuirkOption> quirks;           // needed in addition to `nearest`
  std::string_view encoder_span;             // not part of a generation; empty: unknown
  protocol::Framing framing = protocol::Framing::kCan;
  bool ms = false;    // sure to be of the MS series
  std::string motor;  // from the label in its product info; empty: unknown
  std::vector<Trait> decided;
  std::vector<Trait> unknown;        // visible in logs, but not in this one
  std::vector<Trait> contradictory;  // frames contradict each other
  bool foreign = false;              // replies on identifiers of no LK drive

  /// Returns `quirks`, and `encoder_span` if known.
  std::vector<QuirkOption> all_quirks() const;
  /// Returns text like "--generation v235 --quirk single_turn_bits=16".
  std::string options() const;
};

/// Substitute for every MS motor, because frames do not show which one it is.
inline constexpr std::string_view kMsStandIn = "ms4010";

Guess guess_of(const Evidence& evidence);
/// Returns the names of the possible values: "centivolt", "centivolt_and_bus_current".
std::vector<std::string_view> possible_value_names(Trait trait, const Evidence& evidence);
/// Returns the unknown traits that separate the generations that fit, or the nearest ones if none
/// fits.
std::vector<Trait> telling(const Guess& guess);

}  // namespace lk::emulator
