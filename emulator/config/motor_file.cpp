#include "emulator/config/motor_file.hpp"

#include <algorithm>
#include <filesystem>
#include <numbers>
#include <optional>
#include <regex>
#include <utility>

#include "emulator/config/config.hpp"
#include "emulator/config/config_reader.hpp"
#include "emulator/core/servo/registers.hpp"
#include "emulator/core/text.hpp"
#include "emulator/core/units.hpp"
#include "model/control/current_loop.hpp"
#include "model/control/current_loop_params.hpp"
#include "model/control/motion_loops.hpp"

namespace lk::emulator {
namespace {

using std::numbers::pi;

/// Rotor speed at which back-EMF, friction current and dead time use up the voltage:
///   V·m/√3·(1 − …) = ω·p·ψ + R·i₀(ω),  i₀ = (τ_c + τ_c,out/N + B·ω)/k_t.
double no_load_speed_rad_s(const model::DriveParams& p, double k_t) {
  const model::MechanicsParams& m = p.mechanics;
  const double R = p.motor.R_s + p.inverter.R_on;
  // The dead time subtracts a square wave. Its fundamental, v_dead, is 4/π of its height.
  const double v_dead = 4 / pi * p.inverter.t_dead * p.inverter.f_pwm * p.supply.v_source;
  const double tau = m.tau_coulomb + m.tau_coulomb_out / m.gear_ratio;
  return (model::modulation(p.inverter) * p.supply.v_source - v_dead - R * tau / k_t) /
         (p.motor.pole_pairs * p.motor.psi_f + R * m.B / k_t);
}

}  // namespace

MotorFigures motor_figures(const Profile& profile) {
  const model::DriveParams& p = profile.drive;
  const model::MechanicsParams& m = p.mechanics;
  const double p_psi = p.motor.pole_pairs * p.motor.psi_f;
  const double k_t = 1.5 * p_psi;
  const double R = p.motor.R_s + p.inverter.R_on;
  const double J = m.J + m.J_out / (m.gear_ratio * m.gear_ratio);
  const model::MotionParams loops = model::motion_params(p, control_settings(profile.factory));
  const model::CurrentLoopParams<double> current =
      model::current_loop_params(p, control_settings(profile.factory));

  MotorFigures f;
  f.k_t_Nm_A = k_t;
  f.no_load_speed_rpm = no_load_speed_rad_s(p, k_t) / m.gear_ratio * 30 / pi;
  f.stall_current_A = std::min(p.supply.v_source / std::numbers::sqrt3 / R, p.current_sensor.range);
  f.stall_torque_Nm =
      std::max(0.0, (k_t * f.stall_current_A - m.tau_static) * m.gear_ratio * m.gear_efficiency -
                        m.tau_coulomb_out);
  f.electrical_time_constant_ms = p.motor.L_q / R * 1e3;
  f.mechanical_time_constant_ms = R * J / (1.5 * p_psi * p_psi) * 1e3;
  f.current_bandwidth_Hz = p.control.has_current_loop ? current.kp_q / p.motor.L_q / (2 * pi) : 0.0;
  f.speed_bandwidth_Hz = loops.speed_kp * k_t / J / (2 * pi);
  f.position_bandwidth_Hz = loops.angle_kp / (2 * pi);
  return f;
}

LabelFacts label_facts(const std::string& label) {
  static const std::regex gear("-i([0-9]{1,3})(?![0-9])"), winding("([0-9]+t)$");
  static const std::regex two_encoders("^mg[0-9]{4}e"),
      one_encoder("^mg[0-9]{4}-?(v[0-9]+-?)?i[0-9]");
  static const std::regex later("^mf[0-9]{4}-?v2(?![0-9])|^mhf7015");
  const std::string word = small_letters(label);
  LabelFacts facts;
  std::smatch found;
  if (std::regex_search(word, found, gear)) facts.gear = std::stoi(found.str(1));
  if (std::regex_search(word, found, winding)) facts.winding = found.str(1);
  if (std::regex_search(word, two_encoders)) facts.encoder_span = EncoderSpan::kOutputTurn;
  if (std::regex_search(word, one_encoder)) facts.encoder_span = EncoderSpan::kRotorTurn;
  facts.later_print = std::regex_search(word, later);
  return facts;
}

std::string plain_path(const std::string& path) {
  std::filesystem::path kept;
  for (const auto& part : std::filesystem::path(path)) {
    if (part != ".") kept /= part;
  }
  return kept.generic_string();
}

bool is_path(const std::string& given) {
  return given.find('/') != std::string::npos || given.ends_with(".toml");
}

std::string motor_of(const std::string& file, const std::string& motor) {
  const std::size_t slash = file.rfind('/');
  const bool whole = std::filesystem::path(motor).has_root_directory();
  if (!is_path(motor) || whole || slash == std::string::npos) return motor;
  const std::string path = plain_path(file.substr(0, slash + 1) + motor);
  return is_path(path) ? path : "./" + path;
}

std::vector<std::string> motor_labels(const std::string& text, const std::string& file) {
  const toml::table document = parse_toml(text, file);
  TableReader reader(document, file, "");
  std::vector<std::string> labels;
  if (const auto model = reader.text("model")) labels.push_back(*model);
  for (const std::string& alias : reader.texts("aliases")) labels.push_back(alias);
  return labels;
}

}  // namespace lk::emulator
