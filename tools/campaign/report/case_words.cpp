#include "tools/campaign/report/case_words.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>

namespace lk::emulator {
namespace {

constexpr std::string_view kKindDimension = "fault.kind";

}  // namespace

std::string outcome_key(CaseOutcome outcome) {
  if (outcome == CaseOutcome::kDetectedByDrive) return "detected_by_drive";
  if (outcome == CaseOutcome::kDetectedByHost) return "detected_by_host";
  std::string key{to_string(outcome)};
  std::ranges::replace(key, ' ', '_');
  return key;
}

std::string values_text(const CaseResult& result, const CampaignHead& head) {
  std::string text;
  for (std::size_t n = 0; n < std::min(result.values.size(), head.dimensions.size()); ++n) {
    if (!result.values[n] || head.dimensions[n].name == kKindDimension) continue;
    if (!text.empty()) text += ", ";
    text += head.dimensions[n].name + '=' + value_text(*result.values[n]);
  }
  return text;
}

std::optional<std::size_t> kind_dimension(const CampaignHead& head) {
  const auto found =
      std::ranges::find(head.dimensions, std::string(kKindDimension), &DimensionHead::name);
  if (found == head.dimensions.end()) return std::nullopt;
  return static_cast<std::size_t>(found - head.dimensions.begin());
}

std::string kind_of(const CaseResult& result, std::optional<std::size_t> dimension) {
  if (!dimension) return "any";
  if (*dimension >= result.values.size() || !result.values[*dimension]) return "none";
  return value_text(*result.values[*dimension]);
}

std::optional<SimTime> since_effect(const CaseResult& result, const std::optional<SimTime>& at) {
  if (!result.first_effect_at || !at) return std::nullopt;
  return *at - *result.first_effect_at;
}

std::optional<SimTime> latency_of(const CaseResult& result) {
  const auto drive = since_effect(result, result.detected_by_drive);
  const auto host = since_effect(result, result.detected_by_host);
  if (drive && host) return std::min(*drive, *host);
  return drive ? drive : host;
}

std::string note_of(const CaseResult& result) {
  return result.note + (result.note.empty() || result.said.empty() ? "" : "; ") + result.said;
}

double seconds_of(SimTime time) { return std::chrono::duration<double>(time).count(); }

std::string shell_word(const std::string& text) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./+,=:@%";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + '\'';
}

}  // namespace lk::emulator
