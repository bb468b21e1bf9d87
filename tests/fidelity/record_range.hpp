#pragma once

/// @file Figures of the emulated drives, for docs/internals/fidelity.md.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/fidelity/statistics.hpp"

namespace lk::test {

/// Writes the 5 %, 50 % and 95 % quantiles of `values` into the report of --gtest_output=json.
inline void record_range(const std::string& what, const std::vector<double>& values) {
  ::testing::Test::RecordProperty(what, std::to_string(quantile(values, 0.5)) + " (" +
                                            std::to_string(quantile(values, 0.05)) + " to " +
                                            std::to_string(quantile(values, 0.95)) + ")");
}

}  // namespace lk::test
