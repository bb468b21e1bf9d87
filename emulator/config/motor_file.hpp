#pragma once

/// @file Motor files, found by name or path; profile.cpp implements `extends`.

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "emulator/core/bus_config.hpp"

namespace lk::emulator {

/// Figures of a motor, computed in closed form from its profile (docs/internals/model.md §3, §11).
/// At 25 °C, nominal supply and factory registers; speeds and torques at the output shaft.
struct MotorFigures {
  double k_t_Nm_A = 0;           // rotor side, 3/2·p·ψ_f
  double no_load_speed_rpm = 0;  // back-EMF, friction current and dead time use up the voltage
  double stall_torque_Nm = 0;    // at the largest current that supply and sensor allow
  double stall_current_A = 0;
  double electrical_time_constant_ms = 0;  // L_q/R
  double mechanical_time_constant_ms = 0;  // R·J/(3/2·p²·ψ_f²): to 63 % speed at constant voltage
  double current_bandwidth_Hz = 0;         // with the factory gains
  double speed_bandwidth_Hz = 0;
  double position_bandwidth_Hz = 0;
};

MotorFigures motor_figures(const Profile& profile);

/// The text of a motor file.
struct MotorFile {
  std::string name;  // name in listings and replies: "mf7015", "my.toml"
  std::string file;  // path, for messages; relative paths in `text` start at its directory
  std::string text;
  std::string label{};  // the label by which it was found; empty: by its name or a path
};

/// Facts that the label on a motor tells about its drive, beyond the motor file.
struct LabelFacts {
  std::optional<EncoderSpan> encoder_span;  // of geared motors
  bool later_print = false;                 // replies show 16 bits of an 18-bit encoder
  std::optional<int> gear;                  // 10 for "MG5010E-i10"
  std::string winding;                      // "35t" for "MF9025-35T"; empty: none
};

/// Reads a label such as "MG5010E-i10" or "MF9025v2-16T" (docs/start/which-drive.md); ignores case.
LabelFacts label_facts(const std::string& label);

/// Returns a motor file by name or path. Throws UnknownMotor.
using FindMotorFile = std::function<MotorFile(const std::string& motor)>;

/// Largest number of motor files in a chain where each extends the next.
inline constexpr std::size_t kMaxMotorFiles = 8;

/// Removes parts ".": "./a/./b" becomes "a/b". Keeps "..", as it may follow a symbolic link.
std::string plain_path(const std::string& path);

/// Returns true for a path such as "./my.toml" or "motors/my", false for a name.
bool is_path(const std::string& given);

/// Resolves `motor` as written in `file`: a path is relative to the directory of `file`.
std::string motor_of(const std::string& file, const std::string& motor);

/// Returns the trade names of a motor: `model` and `aliases`. Throws ConfigError.
std::vector<std::string> motor_labels(const std::string& text, const std::string& file);

}  // namespace lk::emulator
