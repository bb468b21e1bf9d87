#include "tools/guess/guess.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>

#include "emulator/core/generation.hpp"

namespace lk::emulator {
namespace {

constexpr std::size_t kForeignReplies = 2;  // value of Trait::kReplyId: 0x240

/// Returns true if the trait can tell generations of this drive apart. Only MS drives have 0xA0,
/// and only the other series have a limit of iq.
bool counts(Trait trait, const Evidence& evidence) {
  if (row_of(trait).of == nullptr || !shows_on(trait, evidence.framing())) return false;
  const ValueSet series = evidence.open(Trait::kSeries);
  if (trait == Trait::kOpenLoop) return series == only(kMs);
  if (trait == Trait::kSpeedLimit) return series == only(kNotMs);
  return true;
}

GenerationFit fit_of(Generation generation, const Evidence& evidence) {
  GenerationFit fit{.generation = generation, .against = {}};
  const Quirks quirks = quirks_of(generation, evidence.framing());
  for (std::size_t n = 0; n < kTraitCount; ++n) {
    const auto trait = static_cast<Trait>(n);
    if (!counts(trait, evidence)) continue;
    const std::size_t value = row_of(trait).of(quirks);
    const ValueSet open = evidence.open(trait);
    if (open == all_of(trait)) continue;
    fit.frames_for += evidence.frames_for(trait, value);
    fit.frames_against += evidence.frames_against(trait, value);
    if (open != 0 && !contains(open, value)) fit.against.push_back(trait);
  }
  return fit;
}

/// Returns true if `a` is nearer to the evidence than `b`: fewer contradictions; if equal,
/// contradictions in traits that show less often.
bool nearer(const GenerationFit& a, const GenerationFit& b) {
  if (a.against.size() != b.against.size()) return a.against.size() < b.against.size();
  return b.against < a.against;
}

/// Returns the possible value that the most frames allow.
std::size_t likeliest(Trait trait, const Evidence& evidence) {
  std::optional<std::size_t> best;
  for (std::size_t value = 0; value < row_of(trait).count; ++value) {
    if (!contains(evidence.open(trait), value)) continue;
    if (!best || evidence.frames_for(trait, value) > evidence.frames_for(trait, *best))
      best = value;
  }
  return best.value_or(0);
}

/// Returns the generations that fit; if none fits, those with the fewest contradictions.
std::vector<Generation> candidates_of(const Guess& guess) {
  std::size_t least = SIZE_MAX;
  for (const GenerationFit& fit : guess.generations) least = std::min(least, fit.against.size());
  std::vector<Generation> candidates;
  for (const GenerationFit& fit : guess.generations) {
    if (fit.against.size() == least) candidates.push_back(fit.generation);
  }
  return candidates;
}

}  // namespace

Guess guess_of(const Evidence& evidence) {
  Guess guess;
  guess.framing = evidence.framing();
  for (std::size_t n = 0; n < protocol::kGenerationRows.size(); ++n) {
    guess.generations.push_back(fit_of(static_cast<Generation>(n), evidence));
    if (guess.generations.back().against.empty()) {
      guess.fits.push_back(static_cast<Generation>(n));
    }
  }
  const auto nearest = std::ranges::min_element(guess.generations, nearer);
  guess.nearest = nearest->generation;
  for (const Trait trait : nearest->against) {
    guess.quirks.push_back(
        {row_of(trait).key, row_of(trait).values.at(likeliest(trait, evidence))});
  }
  const ValueSet series = evidence.open(Trait::kSeries);
  for (std::size_t n = 0; n < kTraitCount; ++n) {
    const auto trait = static_cast<Trait>(n);
    const ValueSet open = evidence.open(trait);
    if (open == 0) {
      guess.contradictory.push_back(trait);
    } else if (open != all_of(trait)) {
      guess.decided.push_back(trait);
    }
    const bool relevant = shows_on(trait, guess.framing) &&
                          (trait != Trait::kOpenLoop || series != only(kNotMs)) &&
                          (trait != Trait::kSpeedLimit || series != only(kMs));
    if (relevant && open != 0 && !evidence.decided(trait)) guess.unknown.push_back(trait);
  }
  guess.foreign = evidence.open(Trait::kReplyId) == only(kForeignReplies);
  guess.ms = series == only(kMs);
  if (evidence.decided(Trait::kEncoderSpan)) {
    guess.encoder_span =
        row_of(Trait::kEncoderSpan).values.at(likeliest(Trait::kEncoderSpan, evidence));
  }
  const auto& product = evidence.product();
  const bool may_be_mf = !guess.ms && (!product || product->motor.starts_with("MF")) &&
                         evidence.open(Trait::kEncoderSpan) != only(kOutputTurn);
  if (evidence.decided(Trait::kEncoderBits) && may_be_mf) {
    const std::size_t bits = likeliest(Trait::kEncoderBits, evidence);
    const bool legacy = guess.nearest == Generation::kLegacy;
    if ((bits == k16Bits) == legacy) {
      guess.encoder_bits = row_of(Trait::kEncoderBits).values.at(bits);
    }
  }
  return guess;
}

std::vector<std::string_view> possible_value_names(Trait trait, const Evidence& evidence) {
  std::vector<std::string_view> values;
  for (std::size_t value = 0; value < row_of(trait).count; ++value) {
    if (contains(evidence.open(trait), value)) values.push_back(row_of(trait).values.at(value));
  }
  return values;
}

std::vector<Trait> telling(const Guess& guess) {
  const std::vector<Generation> candidates = candidates_of(guess);
  std::vector<Trait> traits;
  for (const Trait trait : guess.unknown) {
    const auto of = row_of(trait).of;
    if (of == nullptr) continue;
    const std::size_t first = of(quirks_of(candidates.front(), guess.framing));
    const bool same = std::ranges::all_of(candidates, [&](Generation generation) {
      return of(quirks_of(generation, guess.framing)) == first;
    });
    if (!same) traits.push_back(trait);
  }
  // Traits with a query come first: a query is easier than waiting.
  std::stable_partition(traits.begin(), traits.end(),
                        [&guess](Trait trait) { return has_probe(trait, guess.framing); });
  return traits;
}

std::vector<QuirkOption> Guess::all_quirks() const {
  std::vector<QuirkOption> all = quirks;
  if (!encoder_span.empty()) all.push_back({row_of(Trait::kEncoderSpan).key, encoder_span});
  if (!encoder_bits.empty()) all.push_back({row_of(Trait::kEncoderBits).key, encoder_bits});
  return all;
}

std::string Guess::options() const {
  std::string text = "--generation " + std::string(generation_name(nearest));
  if (ms || !motor.empty()) text.append(" --motor ").append(motor.empty() ? kMsStandIn : motor);
  for (const QuirkOption& one : all_quirks()) {
    text.append(" --quirk ").append(one.key).append("=").append(one.value);
  }
  return text;
}

}  // namespace lk::emulator
