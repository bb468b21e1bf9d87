#include "emulator/core/servo/signals.hpp"

#include <algorithm>
#include <array>

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
     [](const DriveView& d) { return d.servo.multi_turn_deg_of(d.truth.theta_ref); }},
    {"duty_a", "duty of leg a, 0 to 1", [](const DriveView& d) { return d.truth.duty_abc[0]; }},
    {"duty_b", "duty of leg b, 0 to 1", [](const DriveView& d) { return d.truth.duty_abc[1]; }},
    {"duty_c", "duty of leg c, 0 to 1", [](const DriveView& d) { return d.truth.duty_abc[2]; }},
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

}  // namespace lk::emulator
