// planted_report DIRECTORY: answers of campaigns that never ran, as the files that campaigns write:
// many.html with tens of thousands of failures, compared with an earlier one; few.html with nothing
// wrong, of `full`; nasty.html.

#include <fstream>
#include <iostream>
#include <string>

#include "report_support.hpp"
#include "tools/campaign/report/answer_json.hpp"
#include "tools/campaign/report/answer_junit.hpp"
#include "tools/campaign/report/answer_page.hpp"
#include "tools/campaign/report/answer_text.hpp"

namespace lk::emulator {
namespace {

constexpr std::uint64_t kCases = 120'000;
// A <text> as pictures have it; its script would tell that it had run.
constexpr const char* kPicture =
    "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 300 90\"><script>window.top.ran = 1"
    "</script><rect width=\"300\" height=\"90\" fill=\"#fff\"/><path d=\"M10 70h120l20-50h140\" "
    "fill=\"none\" stroke=\"#0072B2\" stroke-width=\"2\"/></svg>";

/// Spread as a seed's bits are: SplitMix64 of Steele, Lea and Flood.
std::uint64_t spread(std::uint64_t number) {
  std::uint64_t z = number * 0x9E3779B97F4A7C15ULL + 0x9E3779B97F4A7C15ULL;
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31U);
}

CampaignHead many_head() {
  CampaignHead head = planted_head();
  head.numbers = head.cases = kCases;
  head.seed = 7;
  head.dimensions[0].words = {"jam",   "drop",  "dip", "encoder_jump", "hang",   "kick",
                              "delay", "stale", "sag", "phase_open",   "bus_off"};
  head.dimensions.push_back({.name = "fault.jam.percent", .words = {}, .from = 10, .to = 100});
  head.plan_text =
      "about = \"A joint under every kind of fault\"\nsampling = \"random\"\n"
      "cases = 120000\n\n[dimension]\n\"fault.kind\" = \"all\"\n";
  return head;
}

CaseOutcome drawn_outcome(std::uint64_t bits, std::size_t kind) {
  constexpr std::array<unsigned, kCaseOutcomes> kShares = {4, 10, 14, 40, 62, 76, 94, 97, 100};
  if (kind == 10) return CaseOutcome::kNotFired;
  const auto percent = static_cast<unsigned>((bits >> 8U) % 100);
  std::size_t outcome = 0;
  while (percent >= kShares.at(outcome)) ++outcome;
  const bool harmless = kind == 2 || kind == 6;
  if (harmless && outcome > 4) outcome = 2;
  return static_cast<CaseOutcome>(outcome);
}

CaseResult many_case(const CampaignHead& head, std::uint64_t number, std::uint64_t night) {
  const std::uint64_t bits = spread(number);
  const std::size_t kind = bits % head.dimensions[0].words.size();
  CaseOutcome outcome = drawn_outcome(bits, kind);
  if (night > 0 && number % 9973 == 17) outcome = CaseOutcome::kSilentlyWrong;
  CaseResult result = planted_case(number, head.dimensions[0].words[kind], outcome);
  result.values = {CaseValue(head.dimensions[0].words[kind]),
                   CaseValue(static_cast<double>(100 + (bits >> 16U) % 400) / 1000), std::nullopt};
  if (kind == 0) result.values[2] = static_cast<double>(10 + (bits >> 24U) % 91);
  if (outcome == CaseOutcome::kNotFired) return result;
  constexpr std::array<const char*, 5> kCommands = {"9C", "A1", "A2", "A4", "none"};
  result.command = kCommands.at((bits >> 32U) % (kind == 3 ? 2 : 5));
  result.state = (bits >> 40U) % 8 == 0 ? "stopped" : "running";
  const SimTime latency = std::chrono::microseconds(300 + (bits >> 44U) % 170'000);
  if (outcome == CaseOutcome::kDetectedByDrive)
    result.detected_by_drive = *result.first_effect_at + latency;
  if (outcome == CaseOutcome::kDetectedByHost)
    result.detected_by_host = *result.first_effect_at + latency / 3;
  if (outcome == CaseOutcome::kLate)
    result.detected_by_host = *result.first_effect_at + latency * 5;
  if (is_failure(outcome)) {
    result.violated = "the forearm stands still in the jam";
    result.violated_at = *result.first_effect_at + latency / 2;
    result.margin = -0.001 * static_cast<double>((bits >> 20U) % 900);
    if (outcome == CaseOutcome::kCrash)
      result.note = "signal 11 </script><img src=x onerror=alert(1)>";
  }
  return result;
}

CaseStream many_cases(const CampaignHead& head, std::uint64_t night) {
  return [head, night](const auto& take) {
    for (std::uint64_t number = 0; number < head.numbers; ++number)
      take(many_case(head, number, night));
  };
}

/// The same, one after the other.
CaseSource source_of_many(const CampaignHead& head, std::uint64_t night) {
  std::vector<CaseResult> results;
  many_cases(head, night)([&](const CaseResult& result) { results.push_back(result); });
  return source_of(std::move(results));
}

void write(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

void write_many(const std::string& directory) {
  const CampaignHead head = many_head();
  Answer answer = answer_of(head, many_cases(head, 1));
  for (const CaseResult& result : answer.residual) {
    if (answer.smallest.size() == 4) break;
    answer.smallest.push_back(
        {kind_of(result, 0), result.outcome, result, kPicture, answer.command_of(result.number)});
  }
  const Comparison comparison =
      compare_campaigns(head, source_of_many(head, 0), head, source_of_many(head, 1));
  const auto thresholds = check_thresholds(
      answer, {parse_threshold("coverage>=0.5"), parse_threshold("coverage.lower[jam]>=0.9"),
               parse_threshold("crash<=0"), parse_threshold("coverage[bus_off]>=0.9")});
  write(directory + "/many.html", answer_page(answer, thresholds, &comparison));
  write(directory + "/many.json", answer_json(answer, thresholds, &comparison));
  write(directory + "/many.xml", answer_junit(answer));
  write(directory + "/many.txt",
        answer_text(answer, thresholds) + comparison_text(comparison, answer.plan_file));
}

void write_few(const std::string& directory) {
  const Answer answer = answer_of(planted_head(Sampling::kFull),
                                  stream_of({planted_case(0, "jam", CaseOutcome::kTolerated)}));
  write(directory + "/few.html", answer_page(answer, {}));
}

void write_nasty(const std::string& directory) {
  const std::string nasty =
      "</script><script>window.ran = 1</script><img src=x onerror=\"window.ran = 1\">";
  CampaignHead head = planted_head();
  head.plan_name = head.about = head.plan_text = head.version = head.input_hash = nasty;
  head.dimensions[0].words = {nasty};
  CaseResult result = planted_case(0, nasty, CaseOutcome::kCrash);
  result.violated = result.note = result.state = result.command = nasty;
  Answer answer = answer_of(head, stream_of({result}));
  answer.smallest.push_back({nasty, CaseOutcome::kCrash, result, kPicture, nasty});
  write(directory + "/nasty.html", answer_page(answer, {{nasty, false, {}}}));
}

}  // namespace
}  // namespace lk::emulator

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "planted_report DIRECTORY\n";
    return 2;
  }
  lk::emulator::write_many(argv[1]);
  lk::emulator::write_few(argv[1]);
  lk::emulator::write_nasty(argv[1]);
}
