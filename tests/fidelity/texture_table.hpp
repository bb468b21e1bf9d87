#pragma once

/// @file The texture of every shipped motor, for docs/internals/model.md §15.

#include <string>

namespace lk::test {

/// Returns a table in Markdown. Each row is the median of 20 specimens at 573 dps of the rotor,
/// without load, sampled every 2.5 ms for 2 s.
std::string texture_table();

}  // namespace lk::test
