#include "tools/plot/trace.hpp"

#include <cmath>

namespace lk::emulator {
namespace {

constexpr double kMost = 2048;

}  // namespace

void Trace::add(double time_s, double value) {
  if (stretches_.empty()) start_s_ = time_s;
  widen(time_s);
  const auto number = static_cast<std::int64_t>((time_s - start_s_) / width_s_);
  if (stretches_.empty() || stretches_.back().number != number) {
    stretches_.push_back({.number = number});
  }
  if (std::isfinite(value)) {
    put(stretches_.back(), {time_s, value});
  } else {
    stretches_.back().broken = true;
  }
}

/// Twice as wide, as often as it takes; neighbours become one.
void Trace::widen(double time_s) {
  while ((time_s - start_s_) / width_s_ >= kMost) {
    width_s_ *= 2;
    std::vector<Stretch> merged;
    for (const Stretch& stretch : stretches_) {
      const std::int64_t number = stretch.number / 2;
      if (merged.empty() || merged.back().number != number) merged.push_back({.number = number});
      if (!stretch.empty) {
        put(merged.back(), stretch.lowest);
        put(merged.back(), stretch.highest);
      }
      merged.back().broken |= stretch.broken;
    }
    stretches_ = std::move(merged);
  }
}

void Trace::put(Stretch& stretch, PlotPoint point) {
  if (stretch.empty || point.value < stretch.lowest.value) stretch.lowest = point;
  if (stretch.empty || point.value > stretch.highest.value) stretch.highest = point;
  stretch.empty = false;
}

std::vector<std::vector<PlotPoint>> Trace::runs() const {
  std::vector<std::vector<PlotPoint>> all;
  bool broken = true;
  for (const Stretch& stretch : stretches_) {
    if (!stretch.empty) {
      if (broken || stretch.broken) all.emplace_back();
      const bool low_first = stretch.lowest.time_s <= stretch.highest.time_s;
      all.back().push_back(low_first ? stretch.lowest : stretch.highest);
      if (stretch.lowest.value != stretch.highest.value) {
        all.back().push_back(low_first ? stretch.highest : stretch.lowest);
      }
    }
    broken = stretch.broken;
  }
  return all;
}

}  // namespace lk::emulator
