#include "emulator/config/config_checks.hpp"

#include <algorithm>

#include "emulator/config/profile_fields.hpp"
#include "emulator/config/register_fields.hpp"
#include "emulator/core/servo/servo.hpp"
#include "emulator/core/servo/shaft_angles.hpp"
#include "emulator/core/units.hpp"

namespace lk::emulator {
namespace {

std::string number(double value) { return plain_number(value, 4); }

const model::Protection& protection(const Registers& registers, model::Error kind) {
  return registers.protections[static_cast<std::size_t>(kind)];
}

/// Returns a reader of the table that contains the dotted `key`, and the last part of the key;
/// nullopt if the key is absent.
std::optional<std::pair<TableReader, std::string>> find(const TableReader& drive,
                                                        const std::string& key) {
  TableReader table = drive;
  std::size_t start = 0;
  for (std::size_t dot = key.find('.'); dot != std::string::npos; dot = key.find('.', start)) {
    const auto inner = table.table(key.substr(start, dot - start));
    if (!inner) return std::nullopt;
    table = *inner;
    start = dot + 1;
  }
  std::string last = key.substr(start);
  if (!table.has(last)) return std::nullopt;
  return std::pair(table, last);
}

/// Fails at the first of `keys` that the table of the drive contains; at its `motor` if none.
[[noreturn]] void fail_at_first(const TableReader& drive, const std::vector<std::string>& keys,
                                const std::string& reason) {
  for (const std::string& key : keys) {
    if (const auto found = find(drive, key)) found->first.fail(found->second, reason);
  }
  drive.fail("motor", reason);
}

void check_brake(const TableReader& drive, const ServoConfig& servo) {
  const double tau = servo.profile.drive.brake.tau;
  if (const auto brake = find(drive, "profile.brake")) {
    if (tau == 0 && !find(drive, "profile.brake.tau_mNm")) {
      brake->first.fail("brake", "missing tau_mNm: without it the drive has no brake");
    }
  }
  if (tau == 0) return;
  // The brake holds until a command releases it.
  if (!servo.quirks.dialect.brake_command) {
    const std::string reason =
        "the drive has no command to release it; use generation v236 or quirks.brake_command = "
        "true";
    if (const auto brake = find(drive, "profile.brake")) brake->first.fail("brake", reason);
    drive.fail("motor", "has a brake, and " + reason);
  }
  if (servo.rom.broadcast_mode) {
    fail_at_first(drive, {"settings.broadcast_mode", "profile.brake"},
                  "the brake cannot be released: in multi-drive mode 0x8C comes in 0x288 with a "
                  "payload of zeros, which engages it");
  }
}

/// Checks that the shaft starts between its end stops, at any random boot angle.
void check_end_stops(TableReader& reader, const ServoConfig& servo) {
  const model::DriveParams& drive = servo.profile.drive;
  const auto start_deg = [&](double boot_deg) {
    return start_theta_m(servo, boot_deg) / drive.mechanics.gear_ratio / kRadPerDeg;
  };
  const double drawn_deg = 360 * encoder_turns(servo.profile, servo.quirks);
  const double first = start_deg(servo.boot_angle_deg.value_or(0));
  const double last = start_deg(servo.boot_angle_deg.value_or(drawn_deg));
  const bool below = first < drive.load.theta_min / kRadPerDeg;
  if (!below && last <= drive.load.theta_max / kRadPerDeg) return;
  auto load = reader.table("load");
  const char* stop = below ? "theta_min_deg" : "theta_max_deg";
  if (!servo.boot_angle_deg) {
    load->fail(stop, "the drawn start may lie beyond this end stop: give boot_angle_deg");
  }
  load->fail(stop, "the shaft starts beyond this end stop, at " + number(first) + " deg");
}

/// Rejects a hysteresis above its threshold for quantities that are never negative. They cannot
/// fall to threshold − hysteresis, so the error could never be cleared.
void check_hystereses(const TableReader& drive, const Registers& registers) {
  using enum model::Error;
  for (const model::Error kind : {kOverVoltage, kOverCurrent, kShort, kStall}) {
    const auto& setting = protection(registers, kind);
    if (!setting.enabled || !setting.recoverable || setting.hysteresis <= setting.threshold) {
      continue;
    }
    const auto& keys = profile_fields::kProtections[static_cast<std::size_t>(kind)];
    const std::string table = std::string("settings.protection.") + keys.name + '.';
    const std::string threshold = table + keys.fields[1].key;
    const std::string hysteresis = table + keys.fields[2].key;
    const std::string enabled = table + keys.fields[0].key;
    fail_at_first(drive, {hysteresis, threshold, enabled},
                  std::string(keys.name) + " could never be cleared: its hysteresis, " +
                      number(setting.hysteresis) + ", must not be above its threshold, " +
                      number(setting.threshold));
  }
}

/// Rejects an under-voltage threshold up to the voltage at which the controller starts, and
/// over-voltage at or below under-voltage.
void check_voltages(const TableReader& drive, const model::LogicParams& logic,
                    const Registers& registers) {
  const auto& under = protection(registers, model::Error::kUnderVoltage);
  const double starts_V = logic.v_reset + logic.v_reset_hysteresis;
  if (under.enabled && under.threshold <= starts_V) {
    fail_at_first(drive,
                  {"settings.protection.under_voltage.threshold_V", "profile.logic.reset_V",
                   "profile.logic.reset_hysteresis_V", "settings.protection.under_voltage.enabled"},
                  "under-voltage at " + number(under.threshold) +
                      " V is never reported: the controller does not start below " +
                      number(starts_V) + " V");
  }
  const std::string problem = voltage_problem(registers);
  if (!problem.empty()) {
    fail_at_first(
        drive,
        {"settings.protection.over_voltage.threshold_V",
         "settings.protection.under_voltage.threshold_V",
         "settings.protection.over_voltage.enabled", "settings.protection.under_voltage.enabled"},
        problem);
  }
}

/// The model computes the matrix exponential of the windings as a series, which is accurate up to
/// R·T/L = 0.25 at 25 °C (T: PWM period). Hot windings raise R by up to a half; the error of the
/// series is then still below 1e-6.
std::optional<ModelProblem> winding_problem(const model::DriveParams& d) {
  const double R = d.motor.R_s + d.inverter.R_on;
  const double L = std::min(d.motor.L_d, d.motor.L_q);
  const double share = R / (L * d.inverter.f_pwm);
  if (share < 0.25) return std::nullopt;
  return ModelProblem{
      {d.motor.L_q < d.motor.L_d ? "motor.L_q_mH" : "motor.L_d_mH", "motor.L_q_mH", "motor.R_s_ohm",
       "inverter.f_pwm_kHz", "inverter.R_on_mohm"},
      "L_d_mH and L_q_mH must be above 4 * (R_s_ohm + R_on_mohm / 1000) / f_pwm_kHz: above " +
          number(4 * R / d.inverter.f_pwm * 1e3) + " mH, and one is " + number(L * 1e3)};
}

/// With an elastic gear, the output is a second body. One explicit step per PWM period T is stable
/// while ω²T² + 2·c·T/J < 4. At a quarter of that, the error of the resonance frequency is 5 %.
/// Checks the flange alone, as its load may be removed.
std::optional<ModelProblem> gear_problem(const model::DriveParams& d) {
  const model::MechanicsParams& m = d.mechanics;
  if (m.gear_stiffness_out == 0) return std::nullopt;
  const std::vector<std::string> keys = {"mechanics.J_out_g_cm2",
                                         "mechanics.gear_stiffness_Nm_rad",
                                         "mechanics.gear_damping_Nm_s_rad",
                                         "mechanics.J_g_cm2",
                                         "mechanics.gear_ratio",
                                         "inverter.f_pwm_kHz"};
  if (m.J_out == 0) {
    return ModelProblem{keys,
                        "J_out_g_cm2 must be above 0, for a springy gear moves it; or make the "
                        "gear rigid, gear_stiffness_Nm_rad = 0"};
  }
  const double T = 1 / d.inverter.f_pwm;
  const double both = 1 / m.J_out + 1 / (m.gear_ratio * m.gear_ratio * m.J);
  const double step = (m.gear_stiffness_out * T + 2 * m.gear_damping_out) * T * both;
  if (step <= 1) return std::nullopt;
  return ModelProblem{keys, "the gear is " + number(step) +
                                " times too stiff for what it moves, at this f_pwm_kHz: raise "
                                "J_out_g_cm2 or J_g_cm2, or lower gear_stiffness_Nm_rad or "
                                "gear_damping_Nm_s_rad (0 and 0: rigid)"};
}

void check_model(const TableReader& drive, const ServoConfig& servo) {
  const auto problem = model_problem(servo.profile.drive);
  if (!problem) return;
  std::vector<std::string> keys;
  for (const std::string& key : problem->keys) keys.push_back("profile." + key);
  fail_at_first(drive, keys, problem->reason);
}

}  // namespace

std::optional<ModelProblem> model_problem(const model::DriveParams& drive) {
  for (const auto& problem_of : {winding_problem, gear_problem}) {
    if (auto problem = problem_of(drive)) return problem;
  }
  return std::nullopt;
}

std::string offset_problem(std::uint16_t offset, const model::EncoderParams& encoder) {
  if (offset < (1 << wire_bits(encoder))) return "";
  return "does not fit the encoder of this motor (" + std::to_string(wire_bits(encoder)) +
         " bit on the wire)";
}

std::string control_problem(Series series, const model::ControlParams& control) {
  const bool ms = series == Series::kMs;
  if (control.has_current_loop != ms) return "";
  return ms ? "must be false: an MS drive measures no current"
            : "must be true: only MS drives have no current loop";
}

std::string voltage_problem(const Registers& registers) {
  const auto& under = protection(registers, model::Error::kUnderVoltage);
  const auto& over = protection(registers, model::Error::kOverVoltage);
  if (!under.enabled || !over.enabled || over.threshold > under.threshold) return "";
  return "over-voltage at " + number(over.threshold) + " V must be above under-voltage at " +
         number(under.threshold) + " V: one of them would always be there";
}

void check_settings(const TableReader& reader, const model::DriveParams& drive,
                    const Registers& registers) {
  const std::string offset = offset_problem(registers.encoder_offset, drive.encoder);
  if (!offset.empty()) {
    fail_at_first(reader, {"settings.encoder_offset", "profile.encoder.bits"}, offset);
  }
  check_voltages(reader, drive.logic, registers);
  check_hystereses(reader, registers);
}

void check_drive(TableReader& reader, const ServoConfig& servo) {
  const model::DriveParams& params = servo.profile.drive;
  check_settings(reader, params, servo.rom);
  if (const auto control = find(reader, "profile.control.has_current_loop")) {
    const std::string problem = control_problem(servo.profile.series, params.control);
    if (!problem.empty()) control->first.fail(control->second, problem);
  }
  if (servo.profile.series == Series::kMs && servo.rom.broadcast_mode &&
      !servo.quirks.dialect.multi_drive_more) {
    fail_at_first(reader, {"settings.broadcast_mode"},
                  "the drive would answer no frame: MS drives do not have 0x280; set "
                  "quirks.multi_drive_more = true for the other multi-drive commands");
  }
  check_model(reader, servo);
  check_brake(reader, servo);
  check_end_stops(reader, servo);
}

}  // namespace lk::emulator
