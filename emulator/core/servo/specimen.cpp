#include "emulator/core/servo/specimen.hpp"

#include "emulator/core/seed.hpp"
#include "model/transforms.hpp"
#include "model/trig.hpp"

namespace lk::emulator {
namespace {

/// Specimens of a type differ by up to ± this share; assumed.
constexpr double kSpread = 0.12;

}  // namespace

void draw_specimen(std::uint64_t random, model::DriveParams& drive) {
  const auto drawn = [&] { return uniform(random = mix(random)); };
  const auto factor = [&] { return 1 + kSpread * (2 * drawn() - 1); };
  const auto phase = [&] { return model::kTwoPi * drawn(); };
  model::MechanicsParams& m = drive.mechanics;
  m.tau_cogging *= factor();
  m.tau_cogging_3 *= factor();
  m.cogging_phase = phase();
  m.tau_pole_cogging *= factor();
  m.pole_cogging_phase = phase();
  drive.encoder.inl_1_phase = phase();
  drive.encoder.inl_2_phase = phase();
  // The sensors' offsets are a vector that stands still in the stator.
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
