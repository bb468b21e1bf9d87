#pragma once

#include <cstdint>
#include <vector>

#include "tools/plot/picture.hpp"

namespace lk::emulator {

/// A signal as far as a picture can show it, however long it is: of each of at most 2048 equal
/// stretches of time the smallest and the largest value, where and when they were. What is shorter
/// is kept as it is. A value that is no number breaks the line.
class Trace {
 public:
  /// In the order of time.
  void add(double time_s, double value);

  /// The lines between the breaks, in the order of time.
  std::vector<std::vector<PlotPoint>> runs() const;

 private:
  struct Stretch {
    std::int64_t number;  // of stretches since the start
    bool empty = true;
    bool broken = false;
    PlotPoint lowest{};
    PlotPoint highest{};
  };

  void widen(double time_s);
  static void put(Stretch& stretch, PlotPoint point);

  std::vector<Stretch> stretches_;
  double start_s_ = 0;
  double width_s_ = 1e-9;  // times are said to the nanosecond
};

}  // namespace lk::emulator
