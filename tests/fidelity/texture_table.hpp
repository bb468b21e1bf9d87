#pragma once

/// @file The texture of every shipped motor, for docs/internals/model.md §15.

#include <string>

namespace lk::test {

/// Returns a table in Markdown: motors at 573 dps of the rotor without load, the median of 20
/// specimens, sampled every 2.5 ms for 2 s.
std::string texture_table();

}  // namespace lk::test
