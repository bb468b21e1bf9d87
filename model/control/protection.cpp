#include "model/control/protection.hpp"

#include <bit>
#include <cmath>

namespace lk::model {

bool live(const LogicParams& p, double v_link, double T, LifeState& s) {
  const Life before = s.life;
  if (v_link < p.v_reset) {
    s.life = Life::kInReset;
    return before == Life::kAlive;
  }
  switch (s.life) {
    case Life::kAlive:
      return false;
    case Life::kInReset:
      if (v_link >= p.v_reset + p.v_reset_hysteresis) {
        s = {Life::kBooting, p.boot_time};
      }
      return false;
    case Life::kBooting:
      s.boot_left -= T;
      if (s.boot_left <= 0.0) {
        s.life = Life::kAlive;
      }
      return s.life == Life::kAlive;
  }
  return false;
}

namespace {

constexpr double kStallSpeed = 1.0;  // rad/s, slower counts as standstill (assumed)

/// Returns the distance of a quantity beyond its threshold, in the threshold's unit; > 0: beyond.
double excess(Error error, const Protection& p, const Watched& w, const ProtectionState& s) {
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
      return s.stalled_for - p.threshold;
    case Error::kLostInput:
      return s.silent_for - p.threshold;
  }
  return 0.0;
}

}  // namespace

bool watch(const std::array<Protection, kErrorKinds>& settings, const Watched& watched, double T_m,
           ProtectionState& s) {
  s.silent_for += T_m;
  const bool stalled = std::abs(watched.omega) < kStallSpeed && watched.near_limit;
  s.stalled_for = stalled ? s.stalled_for + T_m : 0.0;
  const ErrorBits before = s.latched;
  for (unsigned left = s.enabled; left != 0; left &= left - 1) {
    const auto index = static_cast<std::size_t>(std::countr_zero(left));
    const auto error = static_cast<Error>(index);
    const Protection& p = settings[index];
    const double beyond = excess(error, p, watched, s);
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

void settings_changed(const std::array<Protection, kErrorKinds>& settings, ProtectionState& s) {
  s.enabled = 0;
  for (int n = 0; n < kErrorKinds; ++n) {
    if (settings[static_cast<std::size_t>(n)].enabled) {
      s.enabled |= bit(static_cast<Error>(n));
    } else {
      s.beyond_for[static_cast<std::size_t>(n)] = 0.0;
      s.cause = static_cast<ErrorBits>(s.cause & ~bit(static_cast<Error>(n)));
    }
  }
}

void feed_input(ProtectionState& s) {
  s.silent_for = 0.0;
  s.cause = static_cast<ErrorBits>(s.cause & ~bit(Error::kLostInput));
}

void clear_errors(const std::array<Protection, kErrorKinds>& settings, ProtectionState& s) {
  ErrorBits stays = s.cause;
  for (int n = 0; n < kErrorKinds; ++n) {
    if (!settings[static_cast<std::size_t>(n)].recoverable) {
      stays |= bit(static_cast<Error>(n));
    }
  }
  s.latched &= stays;
}

}  // namespace lk::model
