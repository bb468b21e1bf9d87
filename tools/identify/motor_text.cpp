#include "tools/identify/motor_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "emulator/config/config_error.hpp"
#include "emulator/config/config_reader.hpp"
#include "emulator/config/motor_figures.hpp"
#include "emulator/ground/text.hpp"

namespace lk::emulator {
namespace {

constexpr double kLeastChange = 0.1;

const IdentifiedValue& value_of(const IdentifiedDrive& drive, std::string_view key) {
  const Quantity* const quantity = find_identified(key);
  return *std::ranges::find(drive.values, quantity, &IdentifiedValue::quantity);
}
bool told(const IdentifiedDrive& drive, std::string_view key) {
  const auto& estimate = value_of(drive, key).estimate;
  return estimate && is_told(*estimate);
}
double number(const IdentifiedDrive& drive, std::string_view key) {
  return value_of(drive, key).estimate->value;
}

int order_of(const IdentifiedDrive& drive) {
  return drive.cogging() != nullptr ? drive.cogging()->order : 0;
}
/// Of the gear: as found, else as the motor file has it.
double efficiency_of(const IdentifiedDrive& drive) {
  return told(drive, "gear_loss") ? 1 - number(drive, "gear_loss")
                                  : drive.track.servo.profile.drive.mechanics.gear_efficiency;
}

std::string toml_string(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : on_one_line(text)) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

/// Lines of one section, and its head when there are any.
class Section {
 public:
  explicit Section(std::string name) : name_(std::move(name)) {}
  /// `from`: what it follows from.
  void add(std::string_view key, double value, const IdentifiedValue& from) {
    const Estimate& e = *from.estimate;
    lines_ += fmt::format("{:<26} = {:<11.5g} # {}: ±{:.2g} %, from {}\n", key, value,
                          letter(quality_of(e)), std::abs(e.half_width / e.value) * 100,
                          from.quantity->how);
  }
  void say(std::string_view line) { lines_ += fmt::format("{}\n", line); }
  std::string text() const { return lines_.empty() ? "" : "\n[" + name_ + "]\n" + lines_; }

 private:
  std::string name_;
  std::string lines_;
};

/// In the keys and units of a motor file (docs/configuration.md); [mechanics] in Nm with `k_t`.
Section mechanics(const IdentifiedDrive& drive, double k_t) {
  const model::MechanicsParams& base = drive.track.servo.profile.drive.mechanics;
  const double N = base.gear_ratio;
  Section section("mechanics");
  const auto add = [&](std::string_view key, double value, std::string_view from) {
    section.add(key, value, value_of(drive, from));
  };
  if (told(drive, "inertia_A_s2_rad")) {
    const double J = number(drive, "inertia_A_s2_rad") * k_t - base.J_out / (N * N);
    add("J_g_cm2", std::max(J * 1e7, 0.1), "inertia_A_s2_rad");
  }
  if (told(drive, "coulomb_A")) {
    const double tau =
        number(drive, "coulomb_A") * k_t - base.tau_coulomb_out / N / efficiency_of(drive);
    const double excess = base.tau_coulomb > 0 ? base.tau_static / base.tau_coulomb : 1;
    add("tau_coulomb_mNm", std::max(tau, 0.0) * 1e3, "coulomb_A");
    section.say(fmt::format("{:<26} = {:<11.5g} # in proportion, as {} has it", "tau_static_mNm",
                            excess * std::max(tau, 0.0) * 1e3,
                            on_one_line(drive.track.servo.profile.name)));
  }
  if (told(drive, "viscous_A_s_rad")) {
    add("B_uNm_s_rad", number(drive, "viscous_A_s_rad") * k_t * 1e6, "viscous_A_s_rad");
  }
  if (told(drive, "cogging_A")) {
    add("tau_cogging_mNm", number(drive, "cogging_A") * k_t * 1e3, "cogging_A");
    section.say(fmt::format("{:<26} = {}", "cogging_per_turn", order_of(drive)));
  }
  if (told(drive, "gear_loss")) add("gear_efficiency", efficiency_of(drive), "gear_loss");
  return section;
}

Section control(const IdentifiedDrive& drive, double k_t) {
  const model::ControlParams& base = drive.track.servo.profile.drive.control;
  const auto& factory = drive.track.servo.rom.gains;
  const auto& gains = drive.track.gains;
  const double kp_byte = gains ? gains->speed_kp : factory.speed_kp;
  const double ki_byte = gains ? gains->speed_ki : factory.speed_ki;
  const double angle_byte = gains ? gains->angle_kp : factory.angle_kp;
  Section section("control");
  if (!gains) section.say("# With the factory's gains: the log says none.");
  double bandwidth = base.speed_bandwidth;
  if (told(drive, "speed_kp_A_s_rad") && kp_byte > 0) {
    bandwidth =
        number(drive, "speed_kp_A_s_rad") * k_t / base.J_nominal * base.ref_speed_kp_byte / kp_byte;
    section.add("speed_bandwidth_rad_s", bandwidth, value_of(drive, "speed_kp_A_s_rad"));
  }
  if (told(drive, "speed_ki_A_rad") && ki_byte > 0) {
    const double rate = number(drive, "speed_ki_A_rad") * k_t / base.J_nominal / bandwidth *
                        base.ref_speed_ki_byte / ki_byte;
    section.add("speed_integral_rate_per_s", rate, value_of(drive, "speed_ki_A_rad"));
  }
  if (told(drive, "angle_kp_per_s") && angle_byte > 0) {
    section.add("angle_kp_per_byte_per_s", number(drive, "angle_kp_per_s") / angle_byte,
                value_of(drive, "angle_kp_per_s"));
  }
  return section;
}

Section windings(const IdentifiedDrive& drive) {
  const model::DriveParams& base = drive.track.servo.profile.drive;
  Section section("motor");
  if (told(drive, "R_ohm")) {
    section.add("R_s_ohm", number(drive, "R_ohm") - base.inverter.R_on - base.supply.R_source / 2,
                value_of(drive, "R_ohm"));
  }
  if (told(drive, "k_t_Nm_A")) {
    section.add("psi_f_Wb", number(drive, "k_t_Nm_A") / 1.5 / base.motor.pole_pairs,
                value_of(drive, "k_t_Nm_A"));
  }
  return section;
}

std::string identified_table(const IdentifiedDrive& drive, const std::vector<std::string>& logs) {
  std::string text = "\n[identified]  # value and 95 % interval, for lk-emu identify --expect\n";
  std::string names;
  for (const std::string& log : logs) names += (names.empty() ? "" : ", ") + toml_string(log);
  text += fmt::format("logs = [{}]\ndrive = {}\n", names, drive.track.id);
  if (order_of(drive) > 0) text += fmt::format("cogging_order = {}\n", order_of(drive));
  for (const IdentifiedValue& one : drive.values) {
    if (!one.estimate || quality_of(*one.estimate) == Quality::kUnknown) continue;
    text += fmt::format("{} = [{:.6g}, {:.6g}, {:.6g}]\n", one.quantity->key, one.estimate->value,
                        one.estimate->low(), one.estimate->high());
  }
  return text;
}

std::string not_told(const IdentifiedDrive& drive) {
  std::string text;
  for (const IdentifiedValue& one : drive.values) {
    if (one.estimate && is_told(*one.estimate)) continue;
    text += fmt::format("#   {}: {}\n", one.quantity->label, one.quantity->experiment);
  }
  return text.empty() ? "" : "#\n# Not told by the log, and what would tell it:\n" + text;
}

std::string load_lines(const IdentifiedDrive& drive, double k_t) {
  if (!told(drive, "gravity_A")) return "";
  const double N = drive.track.servo.profile.drive.mechanics.gear_ratio;
  const double eta = efficiency_of(drive);  // what was found is the mean of up and down
  return fmt::format(
      "#\n# What hung on the shaft goes into the robot file, not here:\n"
      "#   load = {{ tau_gravity_Nm = {:.4g} }}  # {}: ±{:.2g} %\n",
      number(drive, "gravity_A") * k_t * N * 2 / (1 / eta + eta),
      letter(quality_of(*value_of(drive, "gravity_A").estimate)),
      value_of(drive, "gravity_A").estimate->half_width / number(drive, "gravity_A") * 100);
}

}  // namespace

std::string motor_text(const IdentifiedDrive& drive, const std::string& base,
                       const std::vector<std::string>& logs) {
  const Profile& profile = drive.track.servo.profile;
  const bool own_k_t = told(drive, "k_t_Nm_A");
  const double k_t = own_k_t ? number(drive, "k_t_Nm_A") : motor_figures(profile).k_t_Nm_A;
  std::string text = fmt::format(
      "# {} as drive {} of a robot has it.\n"
      "# A within 5 %, B within 15 %, with the 95 % interval of the log.\n"
      "# In Nm with {}: {:.4g} Nm/A.\n",
      on_one_line(profile.model), drive.track.id,
      own_k_t ? "the torque constant that the log shows"
              : "the torque constant of " + profile.name +
                    ", which no log without a known torque shows",
      k_t);
  text += "# Speaks: " + drive.track.guess.options() + "\n";
  text += "# The inertia is that of the rotor with all that hung on it.\n";
  text += load_lines(drive, k_t) + not_told(drive);
  text += fmt::format("\nextends = {}\nmodel = {}\n", toml_string(base),
                      toml_string(profile.model + ", identified"));
  text += windings(drive).text() + mechanics(drive, k_t).text() + control(drive, k_t).text();
  return text + identified_table(drive, logs);
}

std::vector<ExpectedValue> expected_values(const std::string& text, const std::string& file) {
  const toml::table document = parse_toml(text, file);
  const toml::table* const table = document["identified"].as_table();
  if (table == nullptr) {
    throw ConfigError(file, 0, "identified", "is missing; lk-emu identify -o writes it");
  }
  const auto wrong = [&file](std::string_view key, const toml::node& node, const char* why) {
    throw ConfigError(file, static_cast<int>(node.source().begin.line),
                      "identified." + std::string(key), why);
  };
  std::vector<ExpectedValue> values;
  for (const auto& [key, node] : *table) {
    const Quantity* const quantity = find_identified(key.str());
    const toml::array* const three = node.as_array();
    if (quantity == nullptr) continue;  // logs, drive, or of a later version
    if (three == nullptr || three->size() != 3) {
      wrong(key.str(), node, "is not [value, low, high]");
    }
    const auto at = [&](std::size_t n) {
      return (*three)[n].value<double>().value_or(std::nan(""));
    };
    if (!std::isfinite(at(2) - at(1)) || !(at(1) <= at(0)) || !(at(0) <= at(2))) {
      wrong(key.str(), node, "is not [value, low, high] in that order");
    }
    values.push_back({quantity, {at(0), (at(2) - at(1)) / 2}, 0});
    if (quantity->key == "cogging_A") {
      values.back().order = static_cast<int>((*table)["cogging_order"].value_or(std::int64_t{0}));
    }
  }
  return values;
}

Changes changes(const IdentifiedDrive& drive, const std::vector<ExpectedValue>& expected,
                const std::string& file) {
  Changes found;
  for (const ExpectedValue& then : expected) {
    const auto& now = value_of(drive, then.quantity->key).estimate;
    if (!then.quantity->is_of_motor) continue;
    if (!now || !is_told(*now) || !is_told(then.estimate)) {
      found.not_compared.emplace_back(then.quantity->label);
      continue;
    }
    ++found.compared;
    const double change = now->value / then.estimate.value - 1;
    const bool apart = now->low() > then.estimate.high() || now->high() < then.estimate.low();
    if (then.order != 0 && order_of(drive) != then.order) {
      found.lines.push_back(fmt::format("drive {}: cogs {} times a turn, was {} times in {}",
                                        drive.track.id, order_of(drive), then.order, file));
    } else if (apart && std::abs(change) > kLeastChange) {
      found.lines.push_back(fmt::format(
          "drive {}: {} is {:.0f} % {} than in {} ({:.4g} {}, was {:.4g})", drive.track.id,
          then.quantity->label, std::abs(change) * 100, change > 0 ? "more" : "less", file,
          now->value, then.quantity->unit, then.estimate.value));
    }
  }
  return found;
}

}  // namespace lk::emulator
