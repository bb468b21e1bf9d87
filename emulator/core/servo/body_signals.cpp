#include "emulator/core/servo/body_signals.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "emulator/core/units.hpp"

namespace lk::emulator {
namespace {

// One row per line.
// clang-format off
constexpr BodySignal kTable[] = {
    {"contact_N", "normal forces between what moves and the world, summed", [](const BodyState& b, std::size_t) { return b.contact_N; }, false},
    {"fallen", "1 while other parts than the ends of its limbs touch the world, or its trunk has tilted by more than 60 degrees",
     [](const BodyState& b, std::size_t) { return b.fallen ? 1.0 : 0.0; }, false},
    {"x_m", "where the part's frame is, along the world's x", [](const BodyState& b, std::size_t n) { return b.parts[n].position_m[0]; }, true},
    {"y_m", "along y", [](const BodyState& b, std::size_t n) { return b.parts[n].position_m[1]; }, true},
    {"z_m", "along z, up", [](const BodyState& b, std::size_t n) { return b.parts[n].position_m[2]; }, true},
    {"roll_deg", "how it is turned about the world's x, which comes first", [](const BodyState& b, std::size_t n) { return b.parts[n].rpy_rad[0] / kRadPerDeg; }, true},
    {"pitch_deg", "about y, which comes second", [](const BodyState& b, std::size_t n) { return b.parts[n].rpy_rad[1] / kRadPerDeg; }, true},
    {"yaw_deg", "about z, which comes last", [](const BodyState& b, std::size_t n) { return b.parts[n].rpy_rad[2] / kRadPerDeg; }, true},
    {"speed_m_s", "speed of its frame's origin", [](const BodyState& b, std::size_t n) {
       const Triple& v = b.parts[n].speed_m_s;
       return std::hypot(v[0], v[1], v[2]); }, true},
    {"vx_m_s", "this speed along the world's x", [](const BodyState& b, std::size_t n) { return b.parts[n].speed_m_s[0]; }, true},
    {"vy_m_s", "along y", [](const BodyState& b, std::size_t n) { return b.parts[n].speed_m_s[1]; }, true},
    {"vz_m_s", "along z", [](const BodyState& b, std::size_t n) { return b.parts[n].speed_m_s[2]; }, true},
    {"contact_N", "normal forces of all that touches it, summed", [](const BodyState& b, std::size_t n) { return b.parts[n].contact_N; }, true},
};
// clang-format on

bool can_be_listed(const std::string& part) {
  return !part.empty() &&
         std::ranges::none_of(part, [](char c) { return c == ',' || c == '"' || c <= ' '; });
}

}  // namespace

std::span<const BodySignal> body_signal_table() { return kTable; }

BodySignals::BodySignals(std::span<const std::string> parts, BodyState beginning)
    : beginning_(std::move(beginning)) {
  names_.reserve(std::size(kTable) * (parts.size() + 1));  // references stay valid
  const auto add = [this](const std::string& name, const BodySignal& row, std::size_t part) {
    names_.push_back(std::string(kBodyPrefix) + name);
    signals_.push_back({names_.back(), row.about, nullptr, row.read, part});
  };
  for (const BodySignal& row : kTable) {
    if (!row.of_part) add(std::string(row.name), row, 0);
  }
  for (std::size_t part = 0; part < parts.size(); ++part) {
    if (!can_be_listed(parts[part])) continue;
    for (const BodySignal& row : kTable) {
      if (row.of_part) add(parts[part] + '.' + std::string(row.name), row, part);
    }
  }
}

std::vector<const Signal*> signals_with(const BodySignals* body) {
  std::vector<const Signal*> all;
  for (const Signal& signal : signals()) all.push_back(&signal);
  if (body == nullptr) return all;
  for (const Signal& signal : body->all()) all.push_back(&signal);
  return all;
}

}  // namespace lk::emulator
