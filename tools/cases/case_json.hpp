#pragma once

/// @file Results of cases as lines of JSON (docs/reference/formats.md).

#include <cstdint>
#include <span>
#include <string>

#include "tools/cases/case_batch.hpp"

namespace lk::emulator {

std::string results_json(std::span<const CaseRun> cases);
/// Of a case that was only checked: the drives, the duration and the expectations.
std::string possible_json(const CaseRun& one);
std::string impossible_json(std::uint64_t number, const std::string& reason);

}  // namespace lk::emulator
