#include "emulator/core/servo/signals.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "emulator/core/units.hpp"

namespace lk::emulator {
namespace {

double deg(double angle_rad) { return angle_rad / kRadPerDeg; }

// One row per line.
// clang-format off
constexpr Signal kSignals[] = {
    {"angle_deg", "multi-turn angle as the drive reports it (0x92), degrees of the rotor",
     [](const DriveView& d) { return d.servo.multi_turn_deg(d.telemetry); }},
    {"speed_dps", "speed as the drive reports it (0x9C), of the rotor",
     [](const DriveView& d) { return dps_from_rad_s(d.telemetry.omega); }},
    {"encoder", "encoder field of 0x9C, counts",
     [](const DriveView& d) { return static_cast<double>(d.servo.encoder_counts(d.telemetry)); }},
    {"iq_A", "torque current, measured", [](const DriveView& d) { return d.telemetry.i_q; }},
    {"ia_A", "phase current a, measured", [](const DriveView& d) { return d.telemetry.i_a; }},
    {"ib_A", "phase current b, measured", [](const DriveView& d) { return d.telemetry.i_b; }},
    {"ic_A", "phase current c, -a - b of the measured ones", [](const DriveView& d) { return d.telemetry.i_c; }},
    {"power", "share of the largest voltage, -1 to 1", [](const DriveView& d) { return d.telemetry.power; }},
    {"voltage_V", "bus voltage, measured", [](const DriveView& d) { return d.telemetry.v_bus; }},
    {"bus_current_A", "supply current, as the drive estimates it", [](const DriveView& d) { return d.telemetry.i_bus; }},
    {"temperature_C", "motor temperature, measured", [](const DriveView& d) { return d.telemetry.temp_motor; }},
    {"driver_temperature_C", "power stage temperature, measured", [](const DriveView& d) { return d.telemetry.temp_driver; }},
    {"errors", "error bits, latched, as the newest firmware numbers them",
     [](const DriveView& d) { return static_cast<double>(d.telemetry.errors); }},
    {"bridge_on", "1 while the bridge is on", [](const DriveView& d) { return d.telemetry.bridge_on ? 1.0 : 0.0; }},
    {"alive", "1 while the controller has power and has booted", [](const DriveView& d) { return d.telemetry.alive ? 1.0 : 0.0; }},
    {"true_angle_deg", "output shaft, from the rotor's zero", [](const DriveView& d) { return deg(d.truth.theta_out); }},
    {"true_speed_dps", "output shaft", [](const DriveView& d) { return deg(d.truth.omega_out); }},
    {"true_rotor_deg", "rotor, unwrapped", [](const DriveView& d) { return deg(d.truth.theta_m); }},
    {"true_rotor_dps", "rotor", [](const DriveView& d) { return deg(d.truth.omega_m); }},
    {"joint_deg", "the body's joint that the drive turns, 0 without one", [](const DriveView& d) { return deg(d.joint.angle_rad); }},
    {"joint_dps", "the same joint", [](const DriveView& d) { return deg(d.joint.speed_rad_s); }},
    {"joint_Nm", "torque on the body at that joint, mean of the step that has brought it to this angle", [](const DriveView& d) { return d.joint.torque_Nm; }},
    {"true_id_A", "flux current", [](const DriveView& d) { return d.truth.i_d; }},
    {"true_iq_A", "torque current", [](const DriveView& d) { return d.truth.i_q; }},
    {"true_torque_Nm", "electromagnetic torque on the rotor", [](const DriveView& d) { return d.truth.tau_e; }},
    {"true_voltage_V", "link", [](const DriveView& d) { return d.truth.v_bus; }},
    {"winding_C", "winding", [](const DriveView& d) { return d.truth.temp_winding; }},
    {"housing_C", "housing", [](const DriveView& d) { return d.truth.temp_housing; }},
    {"stage_C", "power stage", [](const DriveView& d) { return d.truth.temp_stage; }},
    {"iq_ref_A", "what the current loop was told", [](const DriveView& d) { return d.truth.i_q_ref; }},
    {"speed_ref_dps", "what the speed loop was told, of the rotor", [](const DriveView& d) { return deg(d.truth.omega_ref); }},
    {"angle_ref_deg", "what the position loop was told, of the rotor's multi-turn angle",
     [](const DriveView& d) { return d.servo.angles.multi_turn_deg(d.truth.theta_ref); }},
    {"duty_a", "duty of leg a, 0 to 1", [](const DriveView& d) { return d.truth.duty_abc[0]; }},
    {"duty_b", "duty of leg b, 0 to 1", [](const DriveView& d) { return d.truth.duty_abc[1]; }},
    {"duty_c", "duty of leg c, 0 to 1", [](const DriveView& d) { return d.truth.duty_abc[2]; }},
    {"unasked_deg", "largest distance of the output in an unasked motion: one that begins after a start, 0x80, 0x81, an error, a fault or a silence of the host for 5 of its periods, before the host has received an angle; or to a first target of 0, or to a wrapped target; sampled every ms, or every 100 ms if the drive turns on after its host has received an angle",
     [](const DriveView& d) { return d.unasked.deg(); }},
    {"unasked_dps", "peak speed of the output in unasked motions", [](const DriveView& d) { return d.unasked.dps(); }},
    {"unasked_J", "largest mechanical work of the motor in an unasked motion", [](const DriveView& d) { return d.unasked.J(); }},
};
// clang-format on

// Indexed by model::Error.
constexpr std::array<std::string_view, model::kErrorKinds> kErrorWords = {
    "under_voltage", "over_voltage", "driver_temperature", "motor_temperature", "over_current",
    "short_circuit", "stall",        "lost_input"};

}  // namespace

std::span<const Signal> signals() { return kSignals; }

const Signal* find_signal(std::string_view name) {
  const auto* const found = std::ranges::find(kSignals, name, &Signal::name);
  return found != std::end(kSignals) ? found : nullptr;
}

std::string_view error_word(model::Error error) {
  return kErrorWords[static_cast<std::size_t>(error)];
}

namespace {

// One row per line.
// clang-format off
constexpr BodySignal kTable[] = {
    {"contact_N", "normal forces between what moves and the world, summed", [](const BodyState& b, std::size_t) { return b.contact_N; }, false},
    {"fallen", "1 while other parts than the ends of its limbs touch the world, or its trunk has tilted by more than 60 degrees",
     [](const BodyState& b, std::size_t) { return b.fallen ? 1.0 : 0.0; }, false},
    {"x_m", "where the part's frame is, along the world's x", [](const BodyState& b, std::size_t n) { return b.parts[n].position_m[0]; }, true},
    {"y_m", "along y", [](const BodyState& b, std::size_t n) { return b.parts[n].position_m[1]; }, true},
    {"z_m", "along z, up", [](const BodyState& b, std::size_t n) { return b.parts[n].position_m[2]; }, true},
    {"roll_deg", "how it is turned about the world's x, which comes first", [](const BodyState& b, std::size_t n) { return b.parts[n].rpy_rad[0] / kRadPerDeg; }, true},
    {"pitch_deg", "about y, which comes second", [](const BodyState& b, std::size_t n) { return b.parts[n].rpy_rad[1] / kRadPerDeg; }, true},
    {"yaw_deg", "about z, which comes last", [](const BodyState& b, std::size_t n) { return b.parts[n].rpy_rad[2] / kRadPerDeg; }, true},
    {"speed_m_s", "speed of its frame's origin", [](const BodyState& b, std::size_t n) {
       const Triple& v = b.parts[n].speed_m_s;
       return std::hypot(v[0], v[1], v[2]); }, true},
    {"vx_m_s", "this speed along the world's x", [](const BodyState& b, std::size_t n) { return b.parts[n].speed_m_s[0]; }, true},
    {"vy_m_s", "along y", [](const BodyState& b, std::size_t n) { return b.parts[n].speed_m_s[1]; }, true},
    {"vz_m_s", "along z", [](const BodyState& b, std::size_t n) { return b.parts[n].speed_m_s[2]; }, true},
    {"contact_N", "normal forces of all that touches it, summed", [](const BodyState& b, std::size_t n) { return b.parts[n].contact_N; }, true},
};
// clang-format on

bool can_be_listed(const std::string& part) {
  return !part.empty() &&
         std::ranges::none_of(part, [](char c) { return c == ',' || c == '"' || c <= ' '; });
}

}  // namespace

std::span<const BodySignal> body_signal_table() { return kTable; }

BodySignals::BodySignals(std::span<const std::string> parts, BodyState beginning)
    : beginning_(std::move(beginning)) {
  names_.reserve(std::size(kTable) * (parts.size() + 1));  // references stay valid
  const auto add = [this](const std::string& name, const BodySignal& row, std::size_t part) {
    names_.push_back(std::string(kBodyPrefix) + name);
    signals_.push_back({names_.back(), row.about, nullptr, row.read, part});
  };
  for (const BodySignal& row : kTable) {
    if (!row.of_part) add(std::string(row.name), row, 0);
  }
  for (std::size_t part = 0; part < parts.size(); ++part) {
    if (!can_be_listed(parts[part])) continue;
    for (const BodySignal& row : kTable) {
      if (row.of_part) add(parts[part] + '.' + std::string(row.name), row, part);
    }
  }
}

std::vector<const Signal*> signals_with(const BodySignals* body) {
  std::vector<const Signal*> all;
  for (const Signal& signal : signals()) all.push_back(&signal);
  if (body == nullptr) return all;
  for (const Signal& signal : body->all()) all.push_back(&signal);
  return all;
}

}  // namespace lk::emulator
