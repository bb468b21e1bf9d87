#include "emulator/config/stator.hpp"

namespace lk::emulator {
namespace {

/// Cogging torque of one slot or pole over the volume D²·h of the label, N/m². Uneven magnets cog
/// at every slot at once, uneven teeth at every pole at once (Gašparin et al., IEEE Trans. Magn.
/// 45, 2009). The numbers come from the speed ripple in three logs:
/// - an MS4015, 57 to 79 dps at 720 dps;
/// - a direct drive with 36 slots and 42 poles, 118 to 127 dps at 573 dps;
/// - a geared MG4005, 22 dps at 576 dps. It ripples at its 28 poles (0.22 to 0.48 of the variance)
///   and at three times 24 slots (0.11 to 0.27).
constexpr double kDirectSlot = 24.4, kDirectPole = 11.2;
constexpr double kGearedSlot = 0, kGearedSlot3 = 16, kGearedPole = 24;
/// Fifth and seventh harmonics of the back-EMF together; assumed.
constexpr double kTorqueRipple = 0.01;
/// Offset vector and noise of the current sensors over their range: 0.07 A each of 33 A in
/// the log of an MG4005.
constexpr double kCurrentOffset = 0.0021, kCurrentNoise = 0.0021;

}  // namespace

void set_texture(const Stator& stator, model::DriveParams& drive) {
  model::MechanicsParams& m = drive.mechanics;
  const bool direct = m.gear_ratio == 1;
  const double volume = stator.diameter * stator.diameter * stator.height;
  const int poles = 2 * drive.motor.pole_pairs;
  m.tau_cogging = volume * stator.slots * (direct ? kDirectSlot : kGearedSlot);
  m.tau_cogging_3 = volume * stator.slots * (direct ? 0 : kGearedSlot3);
  m.cogging_per_turn = stator.slots;
  m.tau_pole_cogging = volume * poles * (direct ? kDirectPole : kGearedPole);
  drive.motor.torque_ripple = kTorqueRipple;
  model::CurrentSensorParams& sensor = drive.current_sensor;
  sensor.offset_a = kCurrentOffset * sensor.range;
  sensor.offset_b = -0.5 * sensor.offset_a;
  sensor.noise = kCurrentNoise * sensor.range;
}

}  // namespace lk::emulator
