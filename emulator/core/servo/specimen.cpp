#include "emulator/core/servo/specimen.hpp"

#include "emulator/core/seed.hpp"
#include "model/transforms.hpp"
#include "model/trig.hpp"

namespace lk::emulator {
namespace {

/// Specimens of a type differ by up to ± this share; assumed.
constexpr double kSpread = 0.12;

}  // namespace

void draw_specimen(std::uint64_t random, double theta_m, model::DriveParams& drive) {
  const auto drawn = [&] { return uniform(random = mix(random)); };
  const auto factor = [&] { return 1 + kSpread * (2 * drawn() - 1); };
  const auto phase = [&] { return model::kTwoPi * drawn(); };
  model::MechanicsParams& m = drive.mechanics;
  m.tau_cogging *= factor();
  m.tau_cogging_3 *= factor();
  m.tau_pole_cogging *= factor();
  // Half of the friction holds the rotor beside a detent. If it exceeds the cogging, any phase can
  // occur.
  const double cogging = m.tau_cogging + 3 * m.tau_cogging_3 + m.tau_pole_cogging;
  const double friction = m.tau_static + m.tau_coulomb_out / m.gear_ratio;
  const double held = 0.5 * friction < cogging ? 0.5 * friction / cogging : model::kPi;
  m.cogging_phase = -m.cogging_per_turn * theta_m + held * (2 * drawn() - 1);
  m.pole_cogging_phase = -2.0 * drive.motor.pole_pairs * theta_m + held * (2 * drawn() - 1);
  drive.encoder.inl_1_phase = phase();
  drive.encoder.inl_2_phase = phase();
  // The offsets of the sensors are a vector, fixed to the stator.
  model::CurrentSensorParams& sensor = drive.current_sensor;
  const double size = factor();
  const model::AlphaBeta<double> offset = model::clarke(model::Abc<double>{
      size * sensor.offset_a, size * sensor.offset_b, -size * (sensor.offset_a + sensor.offset_b)});
  const model::Abc<double> turned = model::inverse_clarke(
      model::inverse_park(model::Dq<double>{offset.alpha, offset.beta}, model::sincos(phase())));
  sensor.offset_a = turned.a;
  sensor.offset_b = turned.b;
}

}  // namespace lk::emulator
