#include "tools/campaign/report/answer_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "emulator/core/scenario/scenario_text.hpp"
#include "emulator/ground/text.hpp"

namespace lk::emulator {
namespace {

constexpr std::size_t kCasesShown = 5;  // of each outcome
constexpr std::size_t kBroadestKind = 24;
constexpr std::array<std::string_view, kCaseOutcomes> kHeadings = {
    "not fired", "no effect", "tolerated", "drive", "host", "late", "silent", "hang", "crash"};

std::string count_cell(std::uint64_t count) { return count > 0 ? std::to_string(count) : "-"; }

std::string share_text(const std::optional<double>& share) {
  return share ? fmt::format("{:.4f}", *share) : "-";
}

std::string plural(std::uint64_t count, std::string_view one) {
  return fmt::format("{} {}{}", count, one, count == 1 ? "" : "s");
}

std::string latency_text(const std::optional<SimTime>& latency) {
  return latency ? fmt::format("{:.4g}", seconds_of(*latency)) : "-";
}

std::string head_text(const Answer& answer) {
  const CampaignHead& head = answer.head;
  std::string text = on_one_line(head.plan_name);
  if (!head.about.empty()) text += ": " + on_one_line(head.about);
  text += fmt::format("\n{} of {}, sampling {}, seed {}", answer.all.cases(),
                      plural(head.cases, "case"),
                      kSamplingWords.at(static_cast<std::size_t>(head.sampling)), head.seed);
  if (head.tolerant_time) {
    text += ", tolerant time " + number_text(seconds_of(*head.tolerant_time)) + " s";
  }
  text += ", lk-emu " + on_one_line(head.version) + '\n';
  if (answer.real_time > 0) {
    text += fmt::format("{} in real time, {} with runs that differ in their outcome\n",
                        plural(answer.real_time, "case"), answer.flipped);
  }
  return text + '\n';
}

std::string matrix_row(const KindAnswer& of, std::size_t width) {
  std::string row =
      fmt::format("{:<{}}{:>9}", of.kind.empty() ? "all" : on_one_line(of.kind), width, of.cases());
  for (std::size_t n = 0; n < kCaseOutcomes; ++n) {
    row += fmt::format("{:>{}}", count_cell(of.outcomes.at(n)), kHeadings.at(n).size() + 2);
  }
  return row + fmt::format("{:>10}{:>10}{:>10}{:>10}\n", share_text(of.coverage.share()),
                           latency_text(of.detected.quantile(0.5)),
                           latency_text(of.detected.quantile(0.99)),
                           latency_text(of.detected.worst()));
}

std::string matrix_text(const Answer& answer) {
  std::size_t width = 6;
  for (const KindAnswer& one : answer.kinds) {
    width = std::max(width, std::min(one.kind.size() + 1, kBroadestKind));
  }
  std::string text = fmt::format("{:<{}}{:>9}", "fault", width, "cases");
  for (const std::string_view heading : kHeadings) {
    text += fmt::format("{:>{}}", heading, heading.size() + 2);
  }
  text += fmt::format("{:>10}{:>10}{:>10}{:>10}\n", "coverage", "p50 s", "p99 s", "worst s");
  for (const KindAnswer& one : answer.kinds) {
    if (one.cases() > 0) text += matrix_row(one, width);
  }
  return text + matrix_row(answer.all, width) + '\n';
}

std::string need_text(const ClaimNeed& need) {
  std::string text = fmt::format("  to claim {} %: ", number_text(need.claim * 100));
  if (need.met) return text + "reached\n";
  text += plural(need.all_hits, "more dangerous case") + " that are all detected in time; ";
  return text + (need.at_this_share ? fmt::format("at the present share {}\n", *need.at_this_share)
                                    : "not at the present share\n");
}

std::string coverage_text(const Answer& answer) {
  const Coverage& coverage = answer.all.coverage;
  std::string text = "coverage: " + coverage_sentence(coverage, answer.head.sampling) + '\n';
  for (const ClaimNeed& need : coverage.needs) text += need_text(need);
  return text;
}

std::string latency_line(std::string_view who, const LatencyCounts& latencies) {
  if (latencies.count() == 0) return fmt::format("  {}: none\n", who);
  return fmt::format("  {}: {}, p50 {} s, p99 {} s, worst {} s{}\n", who,
                     plural(latencies.count(), "case"), latency_text(latencies.quantile(0.5)),
                     latency_text(latencies.quantile(0.99)), latency_text(latencies.worst()),
                     latencies.rounded() ? " (p50 and p99 rounded up)" : "");
}

std::string space_text(const Space& space) {
  if (space.size() == 0) return "";
  return fmt::format(
      "space: {} of {} combinations of fault, state and latest command were met, {} never\n",
      space.cells.size(), space.size(), space.holes());
}

/// Those of one outcome: how many there are, and the first of them.
std::string residual_of(const Answer& answer, CaseOutcome outcome) {
  const std::uint64_t count = answer.all.count(outcome);
  if (count == 0) return "";
  std::string text = fmt::format("  {}: {}\n", to_string(outcome), plural(count, "case"));
  std::size_t shown = 0;
  for (const CaseResult& result : answer.residual) {
    if (result.outcome != outcome) continue;
    if (shown++ == kCasesShown) break;
    text += "    " + case_sentence(result, answer.head) + "\n      " +
            on_one_line(answer.command_of(result.number)) + '\n';
  }
  if (count > kCasesShown) {
    text += fmt::format("    and {} more: --html, --json\n", count - kCasesShown);
  }
  return text;
}

std::string residual_text(const Answer& answer) {
  std::string text = fmt::format("residual: {}\n", plural(answer.all.failures(), "case"));
  for (const CaseOutcome outcome :
       {CaseOutcome::kCrash, CaseOutcome::kHang, CaseOutcome::kSilentlyWrong, CaseOutcome::kLate}) {
    text += residual_of(answer, outcome);
  }
  return text;
}

std::string smallest_text(const Answer& answer) {
  if (answer.smallest.empty()) return "";
  std::string text = "smallest cases:\n";
  for (const SmallestCase& one : answer.smallest) {
    text +=
        "  " + case_sentence(one.result, answer.head) + "\n    " + on_one_line(one.command) + '\n';
  }
  return text;
}

}  // namespace

std::string coverage_sentence(const Coverage& coverage, Sampling sampling) {
  if (coverage.dangerous == 0) return "no claim: no case was dangerous";
  const std::string counts =
      fmt::format("{} of {} {} detected in time, {:.4f}", coverage.covered,
                  plural(coverage.dangerous, "dangerous case"),
                  coverage.dangerous == 1 ? "was" : "were", *coverage.share());
  if (!coverage.interval) {
    return fmt::format(R"({}; no claim: bounds need sampling = "random", not "{}")", counts,
                       kSamplingWords.at(static_cast<std::size_t>(sampling)));
  }
  return fmt::format("{}, 95 % interval {:.4f} to {:.4f}", counts, coverage.interval->lower,
                     coverage.interval->upper);
}

std::string case_sentence(const CaseResult& result, const CampaignHead& head) {
  std::string text = fmt::format("case {}: {}, {}", result.number,
                                 kind_of(result, kind_dimension(head)), to_string(result.outcome));
  if (!result.violated.empty()) {
    text += ", \"" + result.violated + "\" failed";
    if (result.violated_at) text += " at " + time_text(*result.violated_at);
  }
  if (const auto latency = latency_of(result)) {
    text += ", detected " + time_text(*latency) + " after the first effect";
  }
  const std::string values = values_text(result, head);
  if (!values.empty()) text += " (" + values + ')';
  if (const std::string note = note_of(result); !note.empty()) text += "; " + note;
  return on_one_line(text);
}

std::string answer_text(const Answer& answer, const std::vector<ThresholdResult>& thresholds) {
  std::string text = head_text(answer) + matrix_text(answer) + coverage_text(answer);
  text += "latency of detection, from the first effect:\n";
  text += latency_line("by the drive", answer.all.by_drive);
  text += latency_line("by the host", answer.all.by_host);
  text += latency_line("by the first of them", answer.all.detected);
  text += space_text(answer.space) + residual_text(answer) + smallest_text(answer);
  for (const ThresholdResult& one : thresholds) {
    text += (one.holds ? "holds: " : "FAILS: ") + on_one_line(threshold_sentence(one)) + '\n';
  }
  return text;
}

std::string comparison_text(const Comparison& comparison, const std::string& plan_file) {
  const std::string plan = plan_file.empty() ? comparison.now.plan_name + ".toml" : plan_file;
  std::string text =
      fmt::format("{} worse, {} better, {} with the same outcome", plural(comparison.worse, "case"),
                  comparison.better, comparison.same);
  if (comparison.not_fired > 0) {
    text += fmt::format(", {} that did not fire before or now", comparison.not_fired);
  }
  text += '\n';
  if (comparison.only_before + comparison.only_now > 0) {
    text += fmt::format("not compared: {} with no result now, {} with none before\n",
                        plural(comparison.only_before, "case"), comparison.only_now);
  }
  if (comparison.before.input_hash != comparison.now.input_hash) {
    text += "the plan or a file that it names has changed in between\n";
  }
  for (std::size_t from = 0; from < kCaseOutcomes; ++from) {
    for (std::size_t to = 0; to < kCaseOutcomes; ++to) {
      const std::uint64_t count = comparison.moves.at(from).at(to);
      if (from == to || count == 0) continue;
      text += fmt::format("  {} -> {}: {}\n", kCaseOutcomeWords.at(from), kCaseOutcomeWords.at(to),
                          count);
    }
  }
  std::uint64_t more = comparison.cases_left_out;
  for (std::size_t n = 0; n < comparison.cases.size(); ++n) {
    constexpr std::size_t kWorseShown = 20;
    if (n >= kWorseShown) {
      more += comparison.cases.size() - n;
      break;
    }
    const WorseCase& one = comparison.cases[n];
    text += fmt::format("worse: {}, was {}\n    lk-emu campaign {} --case {}\n",
                        case_sentence(one.now, comparison.now), to_string(one.before),
                        on_one_line(shell_word(plan)), one.now.number);
  }
  if (more > 0) text += fmt::format("and {} more: --html, --json\n", more);
  return text;
}

}  // namespace lk::emulator
