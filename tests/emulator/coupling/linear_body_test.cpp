// A body that is only an inertia equals a load: a coupled drive behaves like a plain one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/emulator/coupling/coupling_support.hpp"

namespace lk::test {
namespace linear_body_test {

using emulator::Scenario;
using emulator::ScenarioRun;
using emulator::ServoConfig;

constexpr const char* kMotors[] = {"mf4005",     "mf5010",     "mf7015-23t", "mf7015", "mf9025",
                                   "mg4005-14p", "mg4005",     "mg4010",     "mg5010", "mg5210",
                                   "mg6010",     "mg6012-i36", "mg6012-i8",  "mg8008", "mg8016",
                                   "mh9025",     "ms3506",     "ms4010",     "ms4015"};

/// A step of 10 degrees at the output.
void step(ScenarioRun& run, const ServoConfig& servo) {
  const double N = servo.profile.drive.mechanics.gear_ratio;
  const auto increment = static_cast<std::int32_t>(std::lround(1000 * N));
  const auto format = protocol::wire_format(servo.quirks.dialect, servo.profile.series);
  run.receive(0, {std::chrono::milliseconds(100),
                  protocol::encode_query(1, protocol::Position5{increment}, format)});
}

class LinearBody : public testing::TestWithParam<const char*> {};

TEST_P(LinearBody, MovesAsTheSameLoadDoes) {
  for (const double share : {0.1, 1.0, 10.0, 100.0}) {
    const HandBody anything(1, linear_inertia(1.0), kMs);
    ServoConfig servo = on_joint(1, GetParam(), anything);
    const model::MechanicsParams m = servo.profile.drive.mechanics;
    const double J = share * m.gear_ratio * m.gear_ratio * m.J;
    const auto body = std::make_shared<HandBody>(1, linear_inertia(J), kMs);
    ScenarioRun coupled(on_body(body, {servo}));
    servo.profile.drive.load.J = J;
    ScenarioRun plain(on_body(nullptr, {servo}));
    step(coupled, servo);
    step(plain, servo);
    double apart = 0;
    double off = 0;
    for (int ms = 101; ms < 2000; ++ms) {
      coupled.advance_to(ms * kMs);
      plain.advance_to(ms * kMs);
      const double output = coupled.bus(0).truth(1).theta_out;
      apart = std::max(apart, std::abs(output - plain.bus(0).truth(1).theta_out));
      off = std::max(off, std::abs(output - hand_body(coupled).angles()[0]));
    }
    // They differ only by rounding, which encoders may turn into counts.
    EXPECT_LT(apart, 1e-4) << share;
    // The gear's play to either side, and its twist under the peak torque: 1/1000 rad.
    EXPECT_LE(off, 0.5 * m.backlash_out + 2e-3) << share;
  }
}

INSTANTIATE_TEST_SUITE_P(Motors, LinearBody, testing::ValuesIn(kMotors), [](const auto& motor) {
  std::string name = motor.param;
  std::ranges::replace(name, '-', '_');
  return name;
});

}  // namespace linear_body_test
}  // namespace lk::test
