#pragma once

/// @file Samples of a range, for tests whose full range takes long.

#include <cstdlib>
#include <initializer_list>
#include <vector>

namespace lk::test {

/// Returns whether LKEMU_ALL_VALUES=1 is set: whole sweeps and full durations, as before a release.
inline bool all_values() {
  const char* const value = std::getenv("LKEMU_ALL_VALUES");  // NOLINT(concurrency-mt-unsafe)
  return value != nullptr && value[0] == '1';
}

/// Returns integers from `lowest` to `highest`, inclusive, ascending: every seventh, zero, the
/// `edges`, and those up to 2 from either end. With `all_values()`: all of them.
inline std::vector<int> sweep(int lowest, int highest, std::initializer_list<int> edges = {}) {
  const auto is_near = [](int value, int edge) { return value >= edge - 2 && value <= edge + 2; };
  const bool all = all_values();
  std::vector<int> values;
  for (int n = lowest; n <= highest; ++n) {
    bool is_taken =
        all || (n - lowest) % 7 == 0 || is_near(n, lowest) || is_near(n, highest) || is_near(n, 0);
    for (const int edge : edges) is_taken = is_taken || is_near(n, edge);
    if (is_taken) values.push_back(n);
  }
  return values;
}

}  // namespace lk::test
