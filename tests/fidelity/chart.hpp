#pragma once

/// @file Panels with axes, lines and marks as one SVG file; equal bytes on every machine.

#include <string>
#include <utility>
#include <vector>

namespace lk::test {

using Points = std::vector<std::pair<double, double>>;

/// A rectangle with its own axes, from 0 or the least value to the largest.
struct Panel {
  std::string title, x, y;  // y is above the axis
  struct Line {
    Points points;
    bool real = false;   // measured or printed, in another colour
    bool marks = false;  // points, not a line
  };
  std::vector<Line> lines;
};

/// Draws `columns` panels in a row: emulated values in blue, real ones in vermillion.
std::string chart(const std::string& title, const std::vector<Panel>& panels, std::size_t columns);

}  // namespace lk::test
