#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "tools/guess/evidence.hpp"

namespace lk::emulator {

/// How a generation of firmware goes with what was seen of a drive.
struct GenerationFit {
  Generation generation = Generation::kLegacy;
  std::vector<Trait> against;  // the traits that it has otherwise
  std::uint64_t frames_for = 0;
  std::uint64_t frames_against = 0;
};

struct QuirkOption {
  std::string_view key;
  std::string_view value;

  friend bool operator==(const QuirkOption&, const QuirkOption&) = default;
};

/// What a drive is by what was seen of it.
struct Guess {
  std::vector<GenerationFit> generations;    // all of them, from old to new
  std::vector<Generation> fits;              // those with nothing against them
  Generation nearest = Generation::kLegacy;  // the first that fits, or has the least against it
  std::vector<QuirkOption> quirks;           // that `nearest` needs beside
  std::string_view encoder_span;             // no generation says it; empty: the log neither
  protocol::Framing framing = protocol::Framing::kCan;
  bool ms = false;    // sure to be of the MS series
  std::string motor;  // of the label that the drive gave; empty: it gave none that is known
  std::vector<Trait> decided;
  std::vector<Trait> unknown;        // that the log could have told, and does not
  std::vector<Trait> contradictory;  // frames say one thing and the other
  bool foreign = false;              // replies where no LK drive has them

  /// `quirks`, and `encoder_span` where it is known.
  std::vector<QuirkOption> all_quirks() const;
  /// "--generation v235 --quirk single_turn_bits=16"
  std::string options() const;
};

/// The motor that stands in for every MS motor: frames do not show which one it is.
inline constexpr std::string_view kMsStandIn = "ms4010";

Guess guess_of(const Evidence& evidence);
/// The values of a trait that are open, by name: "centivolt", "centivolt_and_bus_current".
std::vector<std::string_view> open_values(Trait trait, const Evidence& evidence);
/// The unknown traits that tell the generations that fit apart; where none fits, those that come
/// nearest.
std::vector<Trait> telling(const Guess& guess);

}  // namespace lk::emulator
