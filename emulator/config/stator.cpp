#include "emulator/config/stator.hpp"

namespace lk::emulator {
namespace {

/// Cogging torque over the volume D²·h of the label, N/m². An MS4015 whose speed ripples by 57 to
/// 79 dps at 720 dps has 690; an MG4005 whose speed ripples by 22 dps at 576 dps has 750.
constexpr double kCoggingPressure = 650;
/// Of it, at the orders of the slots (uneven magnets) and of the poles (uneven teeth; Gašparin et
/// al., IEEE Trans. Magn. 45, 2009). Logs of two direct drives have both orders, with 0.44 and 0.63
/// as much torque at the poles. The log of a geared motor has the poles alone.
constexpr double kDirectSlots = 0.9, kDirectPoles = 0.45;
constexpr double kGearedSlots = 0.0, kGearedPoles = 1.2;
/// Fifth and seventh harmonics of the back-EMF together; assumed.
constexpr double kTorqueRipple = 0.01;
/// Of the range of the current sensors: offset vector and noise. 0.06 A and 0.07 A of 33 A in the
/// log of an MG4005.
constexpr double kCurrentOffset = 0.0018, kCurrentNoise = 0.0021;

}  // namespace

void set_texture(const Stator& stator, model::DriveParams& drive) {
  model::MechanicsParams& m = drive.mechanics;
  const bool direct = m.gear_ratio == 1;
  const double tau = kCoggingPressure * stator.diameter * stator.diameter * stator.height;
  m.tau_cogging = tau * (direct ? kDirectSlots : kGearedSlots);
  m.cogging_per_turn = stator.slots;
  m.tau_pole_cogging = tau * (direct ? kDirectPoles : kGearedPoles);
  drive.motor.torque_ripple = kTorqueRipple;
  model::CurrentSensorParams& sensor = drive.current_sensor;
  sensor.offset_a = kCurrentOffset * sensor.range;
  sensor.offset_b = -0.5 * sensor.offset_a;
  sensor.noise = kCurrentNoise * sensor.range;
}

}  // namespace lk::emulator
