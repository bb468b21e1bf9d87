#pragma once

/// @file Of each way to fail, the least that still does it.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tools/campaign/plan/plan.hpp"
#include "tools/campaign/report/answer.hpp"
#include "tools/campaign/run/offline.hpp"

namespace lk::emulator {

/// The case with the least severity and the shortest time that a search from `failing` finds to
/// have the same outcome: parameters, probability and duration of its fault are moved towards the
/// harmless ends of their dimensions, eight values at a time, as far as nothing excludes them. Its
/// number is that of `failing`.
CaseResult shrunk(const Plan& plan, OfflineRunner& runner, const CaseResult& failing);

/// What a person types to have the case of this result again: "lk-emu campaign PLAN --case 12", and
/// what it has otherwise.
std::string command_of(const Plan& plan, const Answer& answer, const CaseResult& failing,
                       const CaseResult& smallest);

/// The picture of a case, as SVG.
std::string picture_of_case(const Plan& plan, const CaseResult& result);

/// For each kind of fault and each outcome among the failures of `answer`, its smallest case. So
/// many threads. Leaves out one that cannot be had, and ends early, with what it has, when `stop`
/// says so.
std::vector<SmallestCase> smallest_cases(const Plan& plan, const Answer& answer, int jobs,
                                         const std::function<bool()>& stop);

}  // namespace lk::emulator
