#include "model/control/protection.hpp"

#include <cmath>
#include <limits>

namespace lk::model {
namespace {

constexpr double kStallSpeed = 1.0;  // rad/s, slower than this is standing still (assumed)

/// How far a quantity is beyond its threshold (> 0: beyond), in the unit of the threshold.
double excess(Error error, const Protection& p, const Watched& w, double silent_for) {
  switch (error) {
    case Error::kUnderVoltage:
      return p.threshold - w.v_bus;
    case Error::kOverVoltage:
      return w.v_bus - p.threshold;
    case Error::kDriverTemperature:
      return w.temp_driver - p.threshold;
    case Error::kMotorTemperature:
      return w.temp_motor - p.threshold;
    case Error::kOverCurrent:
    case Error::kShort:
      return w.i_peak - p.threshold;
    case Error::kStall:
      return std::abs(w.omega) < kStallSpeed ? std::abs(w.i_q) - p.threshold
                                             : -std::numeric_limits<double>::infinity();
    case Error::kLostInput:
      return silent_for - p.threshold;
  }
  return 0.0;
}

}  // namespace

bool watch(const std::array<Protection, kErrorKinds>& settings, const Watched& watched, double T_m,
           ProtectionState& s) {
  s.silent_for += T_m;
  const ErrorBits before = s.latched;
  for (int n = 0; n < kErrorKinds; ++n) {
    const auto index = static_cast<std::size_t>(n);
    const auto error = static_cast<Error>(n);
    const Protection& p = settings[index];
    if (!p.enabled) {
      s.beyond_for[index] = 0.0;
      s.cause = static_cast<ErrorBits>(s.cause & ~bit(error));
      continue;
    }
    const double beyond = excess(error, p, watched, s.silent_for);
    s.beyond_for[index] = beyond > 0.0 ? s.beyond_for[index] + T_m : 0.0;
    if (beyond > 0.0 && s.beyond_for[index] > p.delay) {
      s.cause |= bit(error);
      s.latched |= bit(error);
    } else if (beyond <= -p.hysteresis) {
      s.cause = static_cast<ErrorBits>(s.cause & ~bit(error));
    }
  }
  return s.latched != before;
}

void clear_errors(ProtectionState& s) { s.latched &= s.cause; }

}  // namespace lk::model
