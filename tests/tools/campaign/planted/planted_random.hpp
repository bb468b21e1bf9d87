#pragma once

#include <random>

#include "tests/tools/campaign/planted/planted.hpp"

namespace lk::emulator::planted {

/// 0 to below 1, the same with every library.
inline double draw(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

inline std::variant<double, std::string> draw(const Dimension& dimension, std::mt19937_64& random) {
  const auto place = [&](std::size_t size) {
    return static_cast<std::size_t>(draw(random) * static_cast<double>(size));
  };
  if (!dimension.words.empty()) return dimension.words[place(dimension.words.size())];
  if (!dimension.numbers.empty()) return dimension.numbers[place(dimension.numbers.size())];
  const double width = dimension.to - dimension.from;
  if (!dimension.whole) return dimension.from + draw(random) * width;
  return dimension.from + static_cast<double>(place(static_cast<std::size_t>(width) + 1));
}

/// A case of the whole space, everything equally likely.
inline Values draw_case(const Bug& bug, std::mt19937_64& random) {
  Values values;
  for (const Dimension& dimension : bug.dimensions) {
    values[dimension.name] = draw(dimension, random);
  }
  return values;
}

}  // namespace lk::emulator::planted
