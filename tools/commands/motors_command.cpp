#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "emulator/config/config_drive.hpp"
#include "emulator/config/motor_file.hpp"
#include "emulator/config/profile.hpp"
#include "emulator/core/generation.hpp"
#include "emulator/core/servo/registers.hpp"
#include "emulator/core/servo/shaft_angles.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/files/profile_files.hpp"
#include "emulator/io/program/loop_margins.hpp"
#include "tools/commands/commands.hpp"

namespace lk::emulator {
namespace {

/// Formats a number that the vendor prints; a dash if the vendor prints none.
std::string printed(double value) { return value > 0 ? fmt::format("{:.4g}", value) : "-"; }

/// Returns the generation of real drives with this motor; a dash if unknown.
std::string seen(const Profile& profile) {
  return profile.seen_generation ? std::string(generation_name(*profile.seen_generation)) : "-";
}

/// Returns the bits of the encoder of a drive that has the default generation.
int encoder_bits(const Profile& profile) {
  return profile.later_print ? 18 : profile.drive.encoder.bits;
}

std::string row(const Profile& profile) {
  const Rating& r = profile.rating;
  std::string text = fmt::format(
      "{:<11} {:<11} {:<6} {:>4.4g} V {:>7} / {:<5} {:>5} / {:<5} {:>5.4g} {:>4} bit  {:<12}{}",
      profile.name, profile.model, protocol::name_of(profile.series), profile.drive.supply.v_source,
      printed(r.torque_rated_Nm), printed(r.torque_peak_Nm), printed(r.speed_rated_rpm),
      printed(r.speed_no_load_rpm), profile.drive.mechanics.gear_ratio, encoder_bits(profile),
      seen(profile), fmt::join(profile.aliases, ", "));
  return text.substr(0, text.find_last_not_of(' ') + 1) + "\n";
}

std::string line(const char* what, const std::string& value) {
  return fmt::format("  {:<34} {}\n", what, value);
}

/// Returns text like "36 a turn 65 mNm, 28 a turn 23 mNm": the harmonics that the motor has.
std::string cogging_text(const model::DriveParams& p) {
  const std::pair<int, double> tones[] = {
      {p.mechanics.cogging_per_turn, p.mechanics.tau_cogging},
      {3 * p.mechanics.cogging_per_turn, p.mechanics.tau_cogging_3},
      {2 * p.motor.pole_pairs, p.mechanics.tau_pole_cogging}};
  std::vector<std::string> parts;
  for (const auto& [per_turn, tau] : tones) {
    if (tau > 0) parts.push_back(fmt::format("{} a turn {:.3g} mNm", per_turn, tau * 1e3));
  }
  return parts.empty() ? "none" : fmt::format("{} at the rotor", fmt::join(parts, ", "));
}

std::string numbers(const Profile& profile) {
  const model::DriveParams& p = profile.drive;
  return line("pole pairs", fmt::format("{}", p.motor.pole_pairs)) +
         line("R_s, L_d, L_q", fmt::format("{:.4g} ohm, {:.4g} mH, {:.4g} mH", p.motor.R_s,
                                           p.motor.L_d * 1e3, p.motor.L_q * 1e3)) +
         line("psi_f", fmt::format("{:.4g} Wb", p.motor.psi_f)) +
         line("J of the rotor", fmt::format("{:.4g} g cm2", p.mechanics.J * 1e7)) +
         line("gear", p.mechanics.gear_ratio == 1
                          ? std::string("none")
                          : fmt::format("{:.4g} : 1, {:.0f} % efficient, {:.3g} arcmin of play",
                                        p.mechanics.gear_ratio, p.mechanics.gear_efficiency * 100,
                                        p.mechanics.backlash_out * 60 * 57.29577951308232)) +
         line("friction: Coulomb, break-away",
              fmt::format("{:.3g} mNm, {:.3g} mNm at the rotor", p.mechanics.tau_coulomb * 1e3,
                          p.mechanics.tau_static * 1e3)) +
         line("cogging", cogging_text(p)) + line("generation seen", seen(profile)) +
         line("encoder",
              fmt::format("{} bit; replies span a turn of the {}", encoder_bits(profile),
                          profile.encoder_span == EncoderSpan::kRotorTurn ? "rotor" : "output")) +
         line("supply", fmt::format("{:.4g} V, {:.3g} ohm, {:.4g} uF in the link",
                                    p.supply.v_source, p.supply.R_source, p.supply.C_link * 1e6)) +
         line("logic", fmt::format("resets below {:.4g} V, starts above {:.4g} V within {:.4g} ms, "
                                   "draws {:.4g} mA",
                                   p.logic.v_reset, p.logic.v_reset + p.logic.v_reset_hysteresis,
                                   p.logic.boot_time * 1e3, p.supply.i_logic * 1e3)) +
         line("brake", p.brake.tau == 0
                           ? std::string("none")
                           : fmt::format("{:.4g} Nm at the rotor, engages in {:.4g} ms, releases "
                                         "in {:.4g} ms",
                                         p.brake.tau, p.brake.engage_time * 1e3,
                                         p.brake.release_time * 1e3)) +
         line("PWM and current loop", fmt::format("{:.4g} kHz", p.inverter.f_pwm * 1e-3)) +
         line("speed and position loops",
              fmt::format("{:.4g} kHz", p.inverter.f_pwm / p.control.motion_divider * 1e-3));
}

/// Describes the factory settings of limits and of all protections.
std::string registers(const Profile& profile) {
  static constexpr const char* kNames[model::kErrorKinds] = {
      "under-voltage", "over-voltage", "driver temperature", "motor temperature", "over-current",
      "short circuit", "stall",        "lost input"};
  static constexpr const char* kUnits[model::kErrorKinds] = {"V", "V", "C", "C",
                                                             "A", "A", "s", "s"};
  const Registers& r = profile.factory;
  std::string text =
      profile.series == Series::kMs
          ? line("Max Power", fmt::format("{} permille", r.max_power_permille))
          : line("Max Torque Current", fmt::format("{} LSB", r.max_torque_current_lsb));
  text += line("Max Speed", fmt::format("{:.6g} dps at the rotor", r.max_speed_dps));
  for (std::size_t kind = 0; kind < r.protections.size(); ++kind) {
    const model::Protection& p = r.protections[kind];
    const std::string hysteresis =
        p.hysteresis > 0 ? fmt::format(", hysteresis {:.4g} {}", p.hysteresis, kUnits[kind]) : "";
    text += line(kNames[kind], fmt::format("{:.4g} {}{}, {}{}", p.threshold, kUnits[kind],
                                           hysteresis, p.enabled ? "on" : "off",
                                           p.recoverable ? "" : ", cleared by power-off only"));
  }
  return text;
}

/// Returns text like "10.6 dB, 53 deg; with a load of ten rotors 9.5 dB, 38 deg".
std::string margins_text(const Profile& profile, Loop loop) {
  const auto text = [&](double rotors) {
    model::DriveParams drive = profile.drive;
    drive.load.J =
        rotors * drive.mechanics.J * drive.mechanics.gear_ratio * drive.mechanics.gear_ratio;
    const Margins m = loop_margins(drive, control_settings(profile.factory), loop);
    return fmt::format("{:.1f} dB, {:.0f} deg", m.gain_dB, m.phase_deg);
  };
  return fmt::format("{}; with a load of ten rotors {}", text(0), text(10));
}

/// Returns the margins of a direct drive with legacy firmware, whose current loop is slow.
std::string legacy_margins(const Profile& profile) {
  if (profile.series != Series::kMf && profile.series != Series::kMh) return "";
  BusOptions options;
  options.firmware.generation = "legacy";
  const Profile legacy = make_servo(1, profile, options).profile;
  return line("legacy: speed loop margins", margins_text(legacy, Loop::kSpeed)) +
         line("legacy: position loop margins", margins_text(legacy, Loop::kPosition));
}

std::string derived(const Profile& profile) {
  const MotorFigures f = motor_figures(profile);
  const std::string current = profile.drive.control.has_current_loop
                                  ? fmt::format("{:.0f} Hz", f.current_bandwidth_Hz)
                                  : std::string("no current loop: voltage mode");
  return line("k_t", fmt::format("{:.4g} Nm/A at the rotor", f.k_t_Nm_A)) +
         line("no-load speed", fmt::format("{:.0f} rpm", f.no_load_speed_rpm)) +
         line("stall torque",
              fmt::format("{:.3g} Nm at {:.3g} A", f.stall_torque_Nm, f.stall_current_A)) +
         line("electrical time constant", fmt::format("{:.3g} ms", f.electrical_time_constant_ms)) +
         line("mechanical time constant", fmt::format("{:.3g} ms", f.mechanical_time_constant_ms)) +
         line("current loop bandwidth", current) +
         line("speed loop bandwidth", fmt::format("{:.3g} Hz", f.speed_bandwidth_Hz)) +
         line("position loop bandwidth", fmt::format("{:.3g} Hz", f.position_bandwidth_Hz)) +
         line("speed loop margins", margins_text(profile, Loop::kSpeed)) +
         line("position loop margins", margins_text(profile, Loop::kPosition)) +
         legacy_margins(profile);
}

std::string origin(const Profile& profile) {
  std::string text;
  if (!profile.aliases.empty()) {
    text += fmt::format("  also sold as {}\n", fmt::join(profile.aliases, ", "));
  }
  for (std::size_t n = 0; n < profile.files.size(); ++n) {
    text += fmt::format("  {} {}\n", n == 0 ? "file" : "extends", profile.files[n]);
  }
  return text;
}

/// Returns all shipped profiles as a table, one line each. Throws ConfigError.
std::string list_motors() {
  std::string text =
      "profile     model       series supply  torque, Nm       speed, rpm     gear  encoder  seen "
      "as     also sold as\n"
      "                                       rated / peak    rated / no load\n";
  for (const std::string& name : known_motors()) text += row(load_profile(name));
  return text +
         "\nTorques and speeds at the output shaft, as printed by the vendor. Seen as: the "
         "generation measured on real\ndrives, --generation seen. Name a motor by its profile, "
         "model or another label, in capital or small letters,\nor by the path of your own file. "
         "One of them in detail:\n  lk-emu motors MOTOR\n";
}

/// Returns one profile with its derived figures.
std::string describe_motor(const Profile& profile) {
  const Rating& r = profile.rating;
  return fmt::format("{} ({}, series {}), {:.4g} V\n", profile.name, profile.model,
                     protocol::name_of(profile.series), profile.drive.supply.v_source) +
         origin(profile) + "\nPrinted by the vendor, or in hosts, at the output shaft\n" +
         line("supply",
              fmt::format("{} to {} V", printed(r.voltage_min_V), printed(r.voltage_max_V))) +
         line("torque rated / peak",
              fmt::format("{} / {} Nm", printed(r.torque_rated_Nm), printed(r.torque_peak_Nm))) +
         line("speed rated / no load", fmt::format("{} / {} rpm", printed(r.speed_rated_rpm),
                                                   printed(r.speed_no_load_rpm))) +
         line("torque constant",
              r.torque_constant_Nm_A > 0
                  ? fmt::format("{:.4g} Nm/A, volts over no-load speed", r.torque_constant_Nm_A)
                  : std::string("-")) +
         "\nNumbers of the profile (origins in its file)\n" + numbers(profile) +
         "\nRegisters as they leave the factory\n" + registers(profile) +
         "\nWhat they amount to (25 C, factory registers; at the output shaft unless it says "
         "rotor)\n" +
         derived(profile);
}

// --- labels, for docs/start/which-drive.md

std::vector<std::string> labels_of(const Profile& profile) {
  std::vector<std::string> labels{profile.model};
  labels.insert(labels.end(), profile.aliases.begin(), profile.aliases.end());
  return labels;
}

std::string labels_text(const Profile& profile, const LabelFacts& like) {
  std::vector<std::string> labels;
  for (const std::string& label : labels_of(profile)) {
    const LabelFacts facts = label_facts(label);
    const bool alike =
        facts.encoder_span == like.encoder_span && facts.later_print == like.later_print;
    if (alike) labels.push_back(label);
  }
  return fmt::format("{}", fmt::join(labels, ", "));
}

/// Describes the encoder field of a drive with such a label: "65536 a turn of the output".
std::string field_text(const Profile& profile, const LabelFacts& facts) {
  const int counts = 1 << wire_bits(profile.drive.encoder);
  if (profile.drive.mechanics.gear_ratio != 1) {
    const EncoderSpan span = facts.encoder_span.value_or(profile.encoder_span);
    return fmt::format("{} a turn of the {}", counts,
                       span == EncoderSpan::kRotorTurn ? "rotor" : "output");
  }
  if (facts.later_print) return "65536 a turn";
  return fmt::format("{} a turn{}", counts,
                     profile.series == Series::kMf ? "; 65536 from `late-legacy` on" : "");
}

std::string iq_text(Series series) {
  constexpr const char* kTexts[] = {"power in ‰; 0xA0, no 0xA1", "33/4096 A", "66/4096 A",
                                    "33/4096 A (assumed)"};
  return kTexts[static_cast<std::size_t>(series)];
}

/// Returns the table of all labels: a row for those that mean the same motor and encoder field.
std::string label_page() {
  std::string text =
      "| label | motor | gear | encoder field | one count of iq, except `legacy` | `--generation "
      "seen` |\n|---|---|---|---|---|---|\n";
  for (const std::string& name : known_motors()) {
    const Profile profile = load_profile(name);
    std::vector<std::string> rows;
    for (const std::string& label : labels_of(profile)) {
      const LabelFacts facts = label_facts(label);
      std::string row = fmt::format(
          "| {} | `{}` | {}:1 | {} | {} | {} |\n", labels_text(profile, facts), name,
          profile.drive.mechanics.gear_ratio, field_text(profile, facts), iq_text(profile.series),
          profile.seen_generation ? "`" + seen(profile) + "`" : "–");
      if (std::ranges::find(rows, row) == rows.end()) rows.push_back(std::move(row));
    }
    text += fmt::format("{}", fmt::join(rows, ""));
  }
  return text;
}

constexpr const char* kMotorsFooter = R"(
Exit status: 0 done, 1 it could not be printed, 2 unusable input.)";

}  // namespace

RunCommand declare_motors(CLI::App& app, Arguments /*arguments*/) {
  app.footer(kMotorsFooter);
  const auto name = std::make_shared<std::string>();
  const auto labels = std::make_shared<bool>(false);
  app.add_option("MOTOR", *name, "motor to show with its derived figures: a name or a file");
  app.add_flag("--labels", *labels, "print the labels as a table for docs/start/which-drive.md");
  return [name, labels] {
    try {
      const std::string text = *labels         ? label_page()
                               : name->empty() ? list_motors()
                                               : describe_motor(load_profile(*name));
      std::fputs(text.c_str(), stdout);
    } catch (const ConfigError& problem) {
      throw StartError(problem.what());
    } catch (const UnknownMotor& problem) {
      throw StartError(std::string("motors: ") + problem.what());
    }
    return 0;
  };
}

}  // namespace lk::emulator
