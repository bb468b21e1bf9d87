#include "emulator/core/faults/make_fault.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/text.hpp"

namespace lk::emulator {
namespace {

std::string print(const FaultSetting& setting) {
  const auto* const word = std::get_if<std::string>(&setting.value());
  return word != nullptr ? "'" + sanitized_line(*word) + "'"
                         : plain_number(std::get<double>(setting.value()));
}

std::string allowed(const FaultParam& param) {
  if (!param.choices.empty()) {
    return "; one of: " + comma_list({param.choices.begin(), param.choices.end()});
  }
  return "; allowed: " + plain_number(param.min) + " to " + plain_number(param.max) +
         (param.whole ? ", whole numbers" : "");
}

bool fits(const FaultParam& param, const FaultValue& value) {
  if (param.choices.empty()) {
    return value.is_number() && value.number() >= param.min && value.number() <= param.max &&
           (!param.whole || value.number() == std::floor(value.number()));
  }
  return !value.is_number() && static_cast<std::size_t>(value.choice()) < param.choices.size();
}

[[noreturn]] void refuse(std::string_view kind, const std::string& why) {
  throw std::invalid_argument("fault '" + sanitized_line(kind) + "': " + why);
}

/// Returns the value of the parameter; nullopt if it is not allowed.
std::optional<FaultValue> value_of(const FaultParam& param, const FaultSetting& setting) {
  if (const auto* const word = std::get_if<std::string>(&setting.value())) {
    const auto found = std::ranges::find(param.choices, *word);
    if (found == param.choices.end()) return std::nullopt;
    return static_cast<FaultChoice>(found - param.choices.begin());
  }
  const FaultValue number = std::get<double>(setting.value());
  return fits(param, number) ? std::optional(number) : std::nullopt;
}

const FaultRow& row_of(std::string_view kind) {
  if (const FaultRow* const row = find_fault(kind)) return *row;
  std::vector<std::string> words;
  for (const FaultRow& row : fault_table()) words.emplace_back(row.word);
  const std::string meant = closest_match(std::string(kind), words);
  refuse(kind, "unknown kind" + (meant.empty() ? "; lk-emu faults lists them"
                                               : "; did you mean " + meant + "?"));
}

void set(Fault& fault, const FaultSetting& setting) {
  const auto& params = fault.row->params;
  const auto param = std::ranges::find(params, setting.word(), &FaultParam::word);
  if (param == params.end() || setting.word().empty()) {
    std::vector<std::string> words;
    for (const FaultParam& one : params) {
      if (!one.word.empty()) words.emplace_back(one.word);
    }
    refuse(fault.row->word,
           "no parameter '" + sanitized_line(setting.word()) + "'" +
               (words.empty() ? "; it takes none" : "; it takes: " + comma_list(words)));
  }
  const auto value = value_of(*param, setting);
  if (!value) {
    refuse(fault.row->word, setting.word() + " is " + print(setting) + allowed(*param));
  }
  fault.values[static_cast<std::size_t>(param - params.begin())] = *value;
}

/// Returns why the IDs do not fit the fault; empty if they do.
std::string ids_problem(const Fault& fault) {
  if (fault.row->of_bus) {
    return fault.ids.empty() ? "" : "belongs to the bus as a whole; leave the IDs out";
  }
  if (fault.ids.empty()) return "no drives; name the IDs of those that have it";
  const bool ascending =
      std::ranges::adjacent_find(fault.ids, std::greater_equal<>()) == fault.ids.end();
  return ascending ? "" : "the IDs must ascend, each once";
}

std::string course_problem(const Fault& fault) {
  const SimTime lasts = fault.duration.value_or(SimTime{0});
  if (!(fault.probability >= 0 && fault.probability <= 1)) {
    return "probability is " + plain_number(fault.probability) + "; allowed: 0 to 1";
  }
  if (fault.duration && fault.row->momentary()) return "is instantaneous; remove the duration";
  if (fault.duration && (lasts <= SimTime{0} || lasts > kLongestTime)) {
    return "duration must be above 0 s, and at most 100000000 s";
  }
  if (fault.every && !fault.duration && !fault.row->momentary()) return "every needs a duration";
  if (fault.every && (*fault.every < kMinFaultPeriod || *fault.every > kLongestTime)) {
    return "every must be at least 0.001 s, and at most 100000000 s";
  }
  if (fault.every && *fault.every <= lasts) return "every must be longer than duration";
  return fault.times < 0 ? "times must not be negative" : "";
}

std::string values_problem(const Fault& fault) {
  for (std::size_t n = 0; n < fault.values.size(); ++n) {
    const FaultParam& param = fault.row->params[n];
    if (!param.word.empty() && !fits(param, fault.values[n])) {
      return "wrong value of " + std::string(param.word) + allowed(param);
    }
  }
  return "";
}

}  // namespace

std::string fault_problem(const Fault& fault) {
  if (fault.row == nullptr) return "a fault without a kind; make it with make_fault";
  for (auto* const check : {values_problem, ids_problem, course_problem}) {
    const std::string problem = check(fault);
    if (!problem.empty()) return "fault '" + std::string(fault.row->word) + "': " + problem;
  }
  return "";
}

Fault make_fault(std::string_view kind, const std::vector<FaultSetting>& settings,
                 std::vector<int> ids) {
  const FaultRow& row = row_of(kind);
  Fault fault = fault_of(row);
  for (const FaultSetting& setting : settings) set(fault, setting);
  for (const FaultParam& param : row.params) {
    if (param.required &&
        std::ranges::find(settings, param.word, &FaultSetting::word) == settings.end()) {
      refuse(kind, std::string(param.word) + " is missing" + allowed(param));
    }
  }
  if (row.needs_one && fault.values == fault_of(row).values) {
    refuse(kind, std::string(row.params[0].word) + " or " + std::string(row.params[1].word) +
                     " is missing");
  }
  std::ranges::sort(ids);
  fault.ids = std::move(ids);
  const std::string problem = fault_problem(fault);
  if (!problem.empty()) throw std::invalid_argument(problem);
  return fault;
}

}  // namespace lk::emulator
