#include "emulator/config/config_checks.hpp"

#include <algorithm>
#include <cstdio>
#include <initializer_list>
#include <optional>

#include "emulator/config/profile_fields.hpp"
#include "emulator/core/servo.hpp"
#include "emulator/core/shaft_angles.hpp"
#include "emulator/core/units.hpp"

namespace lk::emulator {
namespace {

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

const model::Protection& protection(const Registers& registers, model::Error kind) {
  return registers.protections[static_cast<std::size_t>(kind)];
}

/// The table in which the dotted `key` stands, and its last part; none when it is not there.
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

/// Complains about the first of `keys` that the drive states, or about its motor.
[[noreturn]] void blame(const TableReader& drive, std::initializer_list<const char*> keys,
                        const std::string& reason) {
  for (const char* key : keys) {
    if (const auto found = find(drive, key)) found->first.fail(found->second, reason);
  }
  drive.fail("motor", reason);
}

void check_brake(const TableReader& drive, const ServoConfig& servo) {
  const double tau = servo.profile.drive.brake.tau;
  if (const auto brake = find(drive, "profile.brake")) {
    if (tau == 0 && !find(drive, "profile.brake.tau_mNm")) {
      brake->first.fail("brake", "has no tau_mNm, so there is none");
    }
  }
  if (tau == 0) return;
  // It holds until a command releases it.
  if (!servo.quirks.dialect.brake_command) {
    const std::string reason =
        "nothing could release it: the drive has no brake command (generation v236 has, or "
        "quirks.brake_command)";
    if (const auto brake = find(drive, "profile.brake")) brake->first.fail("brake", reason);
    drive.fail("motor", "has a brake, and " + reason);
  }
  if (servo.rom.broadcast_mode) {
    blame(
        drive, {"settings.broadcast_mode", "profile.brake"},
        "nothing could release the brake: in multi-drive mode 0x8C comes in 0x288, with a payload "
        "of zeros, and engages it");
  }
}

/// The shaft has to start between its end stops, wherever the draw puts it.
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

/// What is never below 0 never comes back by more than the threshold.
void check_hystereses(const TableReader& drive, const ServoConfig& servo) {
  using enum model::Error;
  for (const model::Error kind : {kOverVoltage, kOverCurrent, kShort, kStall}) {
    const auto& setting = protection(servo.rom, kind);
    if (!setting.enabled || !setting.recoverable || setting.hysteresis <= setting.threshold) {
      continue;
    }
    const auto& keys = profile_fields::kProtections[static_cast<std::size_t>(kind)];
    const std::string table = std::string("settings.protection.") + keys.name + '.';
    const std::string threshold = table + keys.fields[1].key;
    const std::string hysteresis = table + keys.fields[2].key;
    const std::string enabled = table + keys.fields[0].key;
    blame(drive, {hysteresis.c_str(), threshold.c_str(), enabled.c_str()},
          std::string(keys.name) + " could never be cleared: its hysteresis, " +
              number(setting.hysteresis) + ", must not be above its threshold, " +
              number(setting.threshold));
  }
}

/// A drive that is reset before its protection notices could not report under-voltage.
void check_voltages(const TableReader& drive, const ServoConfig& servo) {
  const auto& under = protection(servo.rom, model::Error::kUnderVoltage);
  const model::LogicParams& logic = servo.profile.drive.logic;
  const double starts_V = logic.v_reset + logic.v_reset_hysteresis;
  if (under.enabled && under.threshold <= starts_V) {
    blame(drive,
          {"settings.protection.under_voltage.threshold_V", "profile.logic.reset_V",
           "profile.logic.reset_hysteresis_V", "settings.protection.under_voltage.enabled"},
          "under-voltage at " + number(under.threshold) +
              " V is never reported: the controller does not start below " + number(starts_V) +
              " V");
  }
  const std::string problem = voltage_problem(servo.rom);
  if (!problem.empty()) {
    blame(drive,
          {"settings.protection.over_voltage.threshold_V",
           "settings.protection.under_voltage.threshold_V",
           "settings.protection.over_voltage.enabled", "settings.protection.under_voltage.enabled"},
          problem);
  }
}

}  // namespace

std::string offset_problem(std::uint16_t offset, const model::EncoderParams& encoder) {
  const int wire_bits = std::min(encoder.bits, 16);
  if (offset < (1 << wire_bits)) return "";
  return "does not fit the encoder of this motor (" + std::to_string(wire_bits) +
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

void check_settings(const TableReader& reader, const ServoConfig& servo) {
  const std::string offset = offset_problem(servo.rom.encoder_offset, servo.profile.drive.encoder);
  if (!offset.empty()) {
    blame(reader, {"settings.encoder_offset", "profile.encoder.bits"}, offset);
  }
  check_voltages(reader, servo);
  check_hystereses(reader, servo);
}

void check_drive(TableReader& reader, const ServoConfig& servo) {
  const model::DriveParams& params = servo.profile.drive;
  check_settings(reader, servo);
  if (const auto control = find(reader, "profile.control.has_current_loop")) {
    const std::string problem = control_problem(servo.profile.series, params.control);
    if (!problem.empty()) control->first.fail(control->second, problem);
  }
  if (servo.profile.series == Series::kMs && servo.rom.broadcast_mode &&
      !servo.quirks.dialect.multi_drive_more) {
    blame(reader, {"settings.broadcast_mode"},
          "the drive would answer nothing: MS drives know no 0x280, and this one has no other "
          "command for several drives (quirks.multi_drive_more)");
  }
  check_brake(reader, servo);
  check_end_stops(reader, servo);
}

}  // namespace lk::emulator
