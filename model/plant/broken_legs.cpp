#include <algorithm>

#include "model/plant/leg_bridge.hpp"

namespace lk::model {

Leg broken_leg(const LegParts& parts, LegFault fault, bool bridge_on, double duty) {
  const double v_diode = parts.v_diode;
  const double R_on = parts.R_on;
  const Leg diodes{Leg::Kind::kDiodes, 0.0, 1.0, v_diode, v_diode, 0.0};
  // While both switches are off, the direction of the current decides which diode conducts.
  const double least = std::max(duty - parts.dead_fraction, 0.0);
  const double most = std::min(duty + parts.dead_fraction, 1.0);
  switch (fault) {
    case LegFault::kNone:
      return bridge_on ? Leg{Leg::Kind::kSwitches,
                             duty - parts.dead_fraction,
                             duty + parts.dead_fraction,
                             parts.dead_drop,
                             parts.dead_drop,
                             R_on}
                       : diodes;
    case LegFault::kPhaseOpen:
      return {Leg::Kind::kOpen, 0.0, 0.0, 0.0, 0.0, 0.0};
    case LegFault::kHighOpen:
      // While the upper switch should conduct, current into the motor takes the lower diode,
      // current out of it the upper one. Otherwise the lower switch conducts.
      return bridge_on ? Leg{Leg::Kind::kDiodes, 0.0, most, most * v_diode, most * v_diode,
                             (1.0 - most) * R_on}
                       : diodes;
    case LegFault::kLowOpen:
      return bridge_on ? Leg{Leg::Kind::kDiodes,      least,       1.0, (1.0 - least) * v_diode,
                             (1.0 - least) * v_diode, least * R_on}
                       : diodes;
    // The terminal is at a rail, or at half the link voltage while the other switch conducts too.
    case LegFault::kHighShorted: {
      const double share = 1.0 - 0.5 * shoot_through(parts, fault, bridge_on, duty);
      return {Leg::Kind::kSwitches, share, share, 0.0, 0.0, R_on};
    }
    case LegFault::kLowShorted: {
      const double share = 0.5 * shoot_through(parts, fault, bridge_on, duty);
      return {Leg::Kind::kSwitches, share, share, 0.0, 0.0, R_on};
    }
  }
  return diodes;
}

double shoot_through(const LegParts& parts, LegFault fault, bool bridge_on, double duty) {
  if (!bridge_on) {
    return 0.0;
  }
  if (fault == LegFault::kHighShorted) {
    return std::max(1.0 - duty - parts.dead_fraction, 0.0);
  }
  return fault == LegFault::kLowShorted ? std::max(duty - parts.dead_fraction, 0.0) : 0.0;
}

BrokenBridgeStep broken_bridge_step(const LegBridgeInput& in, const LegParts& parts,
                                    const BrokenBridge& bridge) {
  Legs legs;
  double shorted = 0.0;  // share of the period
  for (std::size_t n = 0; n < 3; ++n) {
    legs[n] = broken_leg(parts, bridge.legs[n], bridge.on, bridge.duty[n]);
    shorted += shoot_through(parts, bridge.legs[n], bridge.on, bridge.duty[n]);
  }
  constexpr double kSlack = 1e-3;  // rad, electrical: 14 pole pairs at 1e5 rad/s² within 32 µs
  LegBridgeInput input = in;
  input.slack = kSlack;
  const LegBridgeStep solved = leg_bridge(input, legs);
  BrokenBridgeStep result{solved.step, 0.0};
  result.step.p_inverter += solved.p_cut;
  result.step.i_link = std::min(result.step.i_link, bridge.i_emptying);
  if (shorted > 0.0) {
    constexpr double kLeast = 1e-4;  // Ω; ideal switches would give an infinite current
    const double R = std::max(2.0 * parts.R_on, kLeast);
    const double left = exp_decay(-shorted / (bridge.link_rate * R));
    const double most = bridge.i_emptying - std::max(result.step.i_link, 0.0);
    result.i_short = std::clamp(bridge.v_link * bridge.link_rate * (1.0 - left), 0.0, most);
    result.step.i_link += result.i_short;
  }
  return result;
}

}  // namespace lk::model
