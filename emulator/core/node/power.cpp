#include "emulator/core/node/power.hpp"

#include <algorithm>

namespace lk::emulator {
namespace {

/// Time step of a voltage ramp.
constexpr SimTime kRampStep = std::chrono::milliseconds(1);

double fraction(SimTime part, SimTime whole) {
  return static_cast<double>(part.count()) / static_cast<double>(whole.count());
}

}  // namespace

void Power::move(double to_V, SimTime now, SimTime within) {
  after_sag_V_.reset();
  ramp_ = {supply_V_, to_V, now, now + within};
}

void Power::sag(double to_V, SimTime now) {
  const double then_V = after_sag_V_.value_or(ramp_ ? ramp_->to_V : supply_V_);
  move(to_V, now, SimTime{0});
  after_sag_V_ = then_V;
}

std::optional<SimTime> Power::step(SimTime now) {
  if (now >= ramp_->end) {
    supply_V_ = ramp_->to_V;
    ramp_.reset();
    return std::nullopt;
  }
  const double share = fraction(now - ramp_->begin, ramp_->end - ramp_->begin);
  supply_V_ = ramp_->from_V + share * (ramp_->to_V - ramp_->from_V);
  return std::min(now + kRampStep, ramp_->end);
}

}  // namespace lk::emulator
