#include "emulator/config/motor_file.hpp"

#include <algorithm>
#include <filesystem>
#include <numbers>
#include <optional>
#include <utility>

#include "emulator/config/config.hpp"
#include "emulator/config/motor_document.hpp"
#include "emulator/core/servo/registers.hpp"
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
  // The dead time subtracts a square wave of this height; its fundamental is 4/π of it.
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

namespace {

/// "./a/./b" becomes "a/b". A ".." stays, as it may follow a symbolic link.
std::string plain(const std::string& path) {
  std::filesystem::path kept;
  for (const auto& part : std::filesystem::path(path)) {
    if (part != ".") kept /= part;
  }
  return kept.generic_string();
}

/// Keys that are not inherited: trade names, and facts known only of the other motor.
constexpr const char* kNotInherited[] = {"extends", "aliases", "rating", "product",
                                         "seen_generation"};

/// Returns the motor file that `document` extends; nullopt if none.
std::optional<MotorFile> base_of(const toml::table& document, const std::string& file,
                                 const std::vector<std::string>& files,
                                 const FindMotorFile& find_base) {
  TableReader reader(document, file, "");
  const auto motor = reader.text("extends");
  if (!motor) return std::nullopt;
  if (!find_base) reader.fail("extends", "not possible here: no other motor files are available");
  MotorFile base;
  try {
    base = find_base(motor_of(file, *motor));
  } catch (const UnknownMotor& problem) {
    reader.fail("extends", problem.what());
  }
  for (const std::string& other : files) {
    if (plain(other) == plain(base.file)) {
      reader.fail("extends", other + " extends itself");
    }
  }
  if (files.size() >= kMaxMotorFiles) {
    reader.fail("extends", "more than " + std::to_string(kMaxMotorFiles) +
                               " motor files, each extending the next, or a loop of them");
  }
  return base;
}

/// Moves missing values from `base` to `table`; a moved value keeps its source line.
void inherit(toml::table& table, toml::table& base) {
  for (auto&& [key, inherited] : base) {
    toml::node* const own = table.get(key);
    if (own == nullptr) {
      inherited.visit([&, &name = key](auto& value) { table.insert(name, std::move(value)); });
    } else if (own->is_table() && inherited.is_table()) {
      inherit(*own->as_table(), *inherited.as_table());
    }
  }
}

/// Rejects inheritance between series, which differ too much.
void check_series(const toml::table& document, const std::string& file, const toml::table& base) {
  const auto own = document["series"].value<std::string>();
  const auto inherited = base["series"].value<std::string>();
  if (!own || !inherited || *own == *inherited) return;
  TableReader(document, file, "")
      .fail("series", "differs from the motor that it extends: " + *inherited);
}

}  // namespace

bool is_path(const std::string& given) {
  return given.find('/') != std::string::npos || given.ends_with(".toml");
}

std::string motor_of(const std::string& file, const std::string& motor) {
  const std::size_t slash = file.rfind('/');
  const bool whole = std::filesystem::path(motor).has_root_directory();
  if (!is_path(motor) || whole || slash == std::string::npos) return motor;
  const std::string path = plain(file.substr(0, slash + 1) + motor);
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

MotorDocument read_motor_document(const MotorFile& motor, const FindMotorFile& find_base) {
  std::vector<toml::table> tables;  // moved into, as a copy would lose the source lines
  tables.push_back(parse_toml(motor.text, motor.file));
  std::vector<std::string> files{motor.file};
  while (const auto base = base_of(tables.back(), files.back(), files, find_base)) {
    tables.push_back(parse_toml(base->text, base->file));
    files.push_back(base->file);
  }
  for (std::size_t n = tables.size() - 1; n > 0; --n) {
    check_series(tables[n - 1], files[n - 1], tables[n]);
    for (const char* own : kNotInherited) tables[n].erase(own);
    inherit(tables[n - 1], tables[n]);
  }
  return {std::move(tables.front()), std::move(files)};
}

}  // namespace lk::emulator
