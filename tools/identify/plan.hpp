#pragma once

/// @file An excitation that tells of a drive what a log of its work may not: half a minute of
/// speeds, pulses of torque and short moves, for a script that a person runs at the real motor.

#include <string>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "tools/identify/track.hpp"

namespace lk::emulator {

/// How far it may go, at the rotor.
struct PlanLimits {
  double current_A = 0;     // of the pulses
  double speed_dps = 0;     // of the speeds; pulses end at twice as much
  double travel_turns = 0;  // to either side of where it began; the script ends there
  double rate_Hz = 200;     // exchanges per second
};

/// For a motor of which nothing else is known: three times its friction, a twentieth of its no-load
/// speed and 720 dps at most, 20 turns of the rotor; of current half of what the sensors show
/// (assumed).
PlanLimits plan_limits(const Profile& profile);

struct PlanStep {
  Follows what = Follows::kNothing;
  double value = 0;  // A, dps, degrees from where the plan began
  double seconds = 0;
};
/// Rest, speeds, pulses, moves: 30 s. Pulses of alternate and pseudo-random sign, so that the shaft
/// stays about where it is.
std::vector<PlanStep> plan_steps(const PlanLimits& limits);

/// The script, for Python 3 with python-can: asks before it moves, watches speed and travel, and
/// frees the shaft whatever happens. `servo`: the drive, and how it is spoken to; `motor`: what
/// --motor was.
std::string plan_script(const ServoConfig& servo, const std::string& motor,
                        const PlanLimits& limits);

}  // namespace lk::emulator
