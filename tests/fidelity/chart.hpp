#pragma once

/// @file Panels with axes, lines and marks as one SVG file; the same bytes on every machine.

#include <string>
#include <utility>
#include <vector>

namespace lk::test {

using Points = std::vector<std::pair<double, double>>;

/// One rectangle with its own axes, from 0 or the least value to the largest.
struct Panel {
  std::string title, x, y;  // y stands above the axis
  struct Line {
    Points points;
    bool real = false;   // of a real drive, or printed: another colour
    bool marks = false;  // points, not a line
  };
  std::vector<Line> lines;
};

/// `columns` panels in a row. Colours are blue for what is emulated and vermillion for what is
/// real.
std::string chart(const std::string& title, const std::vector<Panel>& panels, std::size_t columns);

}  // namespace lk::test
