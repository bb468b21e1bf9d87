#include "tools/identify/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "emulator/config/motor_figures.hpp"
#include "emulator/core/servo/shaft_angles.hpp"
#include "emulator/frames/reply_values.hpp"
#include "emulator/ground/text.hpp"
#include "tools/identify/plan_body.hpp"

namespace lk::emulator {
namespace {

constexpr double kRest_s = 1.5;
constexpr double kSpeed_s = 2.0;
constexpr std::array kSpeedShares = {0.1, -0.1, 0.2, -0.2, 1.0, -1.0};
constexpr int kPulses = 130;
constexpr std::array kPulse_s = {0.02, 0.04, 0.06};
constexpr std::array kPulseShares = {1.0, 0.7};
constexpr double kMove_s = 0.5;
constexpr std::array kMoves_deg = {90.0, 0.0, 180.0, 0.0, 90.0, -90.0, 0.0};

/// Galois' shift register of 16 bits (x¹⁶ + x¹⁴ + x¹³ + x¹¹ + 1).
unsigned next(unsigned state) { return state >> 1U ^ ((state & 1U) != 0 ? 0xB400U : 0U); }

void add_pulses(const PlanLimits& limits, std::vector<PlanStep>& steps) {
  unsigned state = 0xACE1;
  double sign = 1;
  for (int n = 0; n < kPulses; ++n) {
    for (int k = 0; k < 5; ++k) state = next(state);
    // Two of one sign at most: the other way next.
    sign = (n % 2 != 0) ? -sign : ((state & 1U) != 0 ? 1.0 : -1.0);
    const double share = kPulseShares.at(state >> 3U & 1U);
    const double pulse_s = kPulse_s.at((state >> 5U) % kPulse_s.size());
    steps.push_back({Follows::kTorque, sign * share * limits.current_A, pulse_s});
    steps.push_back({Follows::kTorque, 0, pulse_s});
  }
}

std::string_view word(Follows what) {
  switch (what) {
    case Follows::kTorque:
      return "torque";
    case Follows::kSpeed:
      return "speed";
    case Follows::kPosition:
      return "position";
    case Follows::kNothing:
      break;
  }
  return "rest";
}

constexpr const char* kConstants = R"py(MOTOR, DRIVE = {motor}, {id}
QUERY_ID, REPLY_ID = 0x140 + {id}, {reply:#x} + {id}
A_PER_LSB = {lsb}
COUNTS, ROTOR_TURNS = {counts:.0f}, {span:g}  # of the encoder field, and what they span
FIRST_QUERIES = [{queries}]
RATE_HZ = {rate:g}
SPEED_DPS = {speed:g}  # of the speeds; pulses end at twice as much, everything coasts from five times on
TRAVEL_TURNS = {turns:g}  # of the rotor, to either side
# what, A or dps or degrees from the start, seconds
STEPS = [
{steps}]
)py";

/// A literal of Python.
std::string python_string(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : on_one_line(text)) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

std::string steps_text(const std::vector<PlanStep>& steps) {
  std::string text;
  for (const PlanStep& step : steps) {
    text +=
        fmt::format("    (\"{}\", {:.4g}, {:.3g}),\n", word(step.what), step.value, step.seconds);
  }
  return text;
}

}  // namespace

PlanLimits plan_limits(const Profile& profile) {
  constexpr double kMostSpeed_dps = 720;
  const MotorFigures figures = motor_figures(profile);
  const model::MechanicsParams& m = profile.drive.mechanics;
  const double friction_Nm = m.tau_coulomb + m.tau_coulomb_out / m.gear_ratio;
  const double no_load_dps = figures.no_load_speed_rpm * 6 * m.gear_ratio;
  // Half of what the sensors show (assumed).
  const double most_A = profile.drive.current_sensor.range / 2;
  return {.current_A = std::min(3 * friction_Nm / figures.k_t_Nm_A, most_A),
          .speed_dps = std::min(kMostSpeed_dps, no_load_dps / 20),
          .travel_turns = 20};
}

std::vector<PlanStep> plan_steps(const PlanLimits& limits) {
  std::vector<PlanStep> steps{{Follows::kTorque, 0, kRest_s}};
  for (const double share : kSpeedShares) {
    steps.push_back({Follows::kSpeed, share * limits.speed_dps, kSpeed_s});
  }
  steps.push_back({Follows::kTorque, 0, kMove_s});
  add_pulses(limits, steps);
  for (const double move_deg : kMoves_deg) {
    steps.push_back({Follows::kPosition, move_deg, kMove_s});
  }
  return steps;
}

std::string plan_script(const ServoConfig& servo, const std::string& motor,
                        const PlanLimits& limits) {
  const std::vector<PlanStep> steps = plan_steps(limits);
  const ReplyReader reader(servo);
  const auto& dialect = servo.quirks.dialect;
  std::string queries = "0x9A";
  if (dialect.pid_commands) queries += ", 0x30";
  if (dialect.brake_command) queries += ", 0x8C";
  const std::string constants = fmt::format(
      kConstants, fmt::arg("id", servo.id), fmt::arg("motor", python_string(motor)),
      fmt::arg("reply", dialect.reply_id_base), fmt::arg("lsb", reader.format.iq_command_lsb_A),
      fmt::arg("counts", reader.encoder_counts),
      fmt::arg("span", encoder_turns(servo.profile, servo.quirks)), fmt::arg("queries", queries),
      fmt::arg("rate", limits.rate_Hz), fmt::arg("speed", limits.speed_dps),
      fmt::arg("turns", limits.travel_turns), fmt::arg("steps", steps_text(steps)));
  constexpr std::string_view kPlace = "# (here stand the constants of the plan)\n";
  const std::string_view body = plan_body();
  const std::size_t place = body.find(kPlace);
  return std::string(body.substr(0, place)) + constants +
         std::string(body.substr(place + kPlace.size()));
}

}  // namespace lk::emulator
