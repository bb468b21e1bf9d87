#include <nlohmann/json.hpp>

#include "emulator/core/frame_text.hpp"
#include "emulator/core/generation.hpp"
#include "tools/guess/guess_output.hpp"

namespace lk::emulator {
namespace {

using Json = nlohmann::ordered_json;

std::string line(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

/// Returns the JSON key of a trait: the name of its switch; "series" for kSeries, which is none.
std::string_view key_of(Trait trait) {
  return trait == Trait::kSeries ? "series" : row_of(trait).key;
}

Json finding(Trait trait, const Evidence& evidence) {
  Json values = Json::array();
  for (std::size_t value = 0; value < row_of(trait).count; ++value) {
    Json frames = Json::array();
    for (const Sighting& one : evidence.examples(trait, value)) {
      Json sighting = {{"frame", frame_text(one.frame)}};
      if (one.at) sighting["time_s"] = in_seconds(*one.at);
      frames.push_back(std::move(sighting));
    }
    values.push_back({{"value", row_of(trait).values.at(value)},
                      {"open", contains(evidence.open(trait), value)},
                      {"frames_for", evidence.frames_for(trait, value)},
                      {"frames_against", evidence.frames_against(trait, value)},
                      {"frames", std::move(frames)}});
  }
  return {{"key", key_of(trait)}, {"values", std::move(values)}};
}

Json keys(const std::vector<Trait>& traits) {
  Json all = Json::array();
  for (const Trait trait : traits) all.push_back(key_of(trait));
  return all;
}

Json drive_json(const std::string& interface, int id, const DriveWatch& drive, const Guess& guess) {
  const Evidence& evidence = drive.evidence();
  Json json = {{"type", "drive"},
               {"interface", interface},
               {"drive", id},
               {"queries", drive.queries()},
               {"replies", drive.replies()}};
  if (drive.replies() == 0) return json;
  Json fits = Json::array();
  for (const Generation one : guess.fits) fits.push_back(generation_name(one));
  Json generations = Json::array();
  for (const GenerationFit& fit : guess.generations) {
    generations.push_back({{"generation", generation_name(fit.generation)},
                           {"against", keys(fit.against)},
                           {"frames_for", fit.frames_for},
                           {"frames_against", fit.frames_against}});
  }
  Json quirks = Json::object();
  for (const QuirkOption& one : guess.all_quirks()) quirks[std::string(one.key)] = one.value;
  Json findings = Json::array();
  for (const auto& traits : {guess.decided, guess.contradictory}) {
    for (const Trait trait : traits) findings.push_back(finding(trait, evidence));
  }
  Json ask = Json::array();
  for (const Trait trait : telling(guess)) {
    ask.push_back({{"key", key_of(trait)}, {"send", probe_text(trait, id, guess.framing)}});
  }
  json["foreign"] = guess.foreign;
  if (const auto& product = evidence.product()) {
    json["product"] = {
        {"motor", product->motor}, {"driver", product->driver}, {"firmware", product->firmware}};
  }
  if (!guess.motor.empty()) json["motor"] = guess.motor;
  if (const auto largest = drive.encoder().largest()) json["encoder_largest"] = *largest;
  if (const auto counts = drive.encoder().counts_per_turn()) {
    json["encoder_counts_per_turn"] = *counts;
  }
  json["fits"] = std::move(fits);
  json["nearest"] = generation_name(guess.nearest);
  json["quirks"] = std::move(quirks);
  json["generations"] = std::move(generations);
  json["findings"] = std::move(findings);
  json["contradictory"] = keys(guess.contradictory);
  json["unknown"] = keys(guess.unknown);
  json["ask"] = std::move(ask);
  json["odd_currents"] = drive.odd_currents();
  json["odd_states"] = drive.odd_states();
  return json;
}

}  // namespace

std::string guess_json(const Guesser& guesser) {
  std::string text;
  for (const auto& [wire, bus] : guesser.buses()) {
    for (const auto& [id, drive] : bus.drives) {
      text += line(drive_json(wire.first, id, drive, guesser.guess(drive)));
    }
  }
  const Starts starts = starts_of(guesser, Language::kEnglish);
  Json commands = Json::array();
  for (const StartCommand& one : starts.commands) commands.push_back(one.line);
  Json summary = {{"type", "guess"},
                  {"frames", guesser.frames()},
                  {"bad_lines", guesser.bad_lines()},
                  {"unread_frames", guesser.unread_frames()},
                  {"never_shown", kNeverShown},
                  {"commands", std::move(commands)}};
  if (!starts.robot.empty()) summary["robot"] = starts.robot;
  return text + line(summary);
}

}  // namespace lk::emulator
