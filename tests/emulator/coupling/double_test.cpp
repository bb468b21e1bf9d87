// Two drives on two joints that pull at each other.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/emulator/coupling/coupling_support.hpp"

namespace lk::test {
namespace double_test {

using emulator::ScenarioRun;
using emulator::ServoConfig;

/// Both outputs take a step of 20 degrees, the second the other way.
ScenarioRun swing(const char* motor, double m, double l, emulator::SimTime step) {
  const auto body = std::make_shared<HandBody>(2, double_pendulum(m, l), step, Two{0.3, -0.2});
  ServoConfig first = on_joint(1, motor, *body);
  ServoConfig second = on_joint(2, motor, *body);
  ScenarioRun run(on_body(body, {first, second}));
  const double N = first.profile.drive.mechanics.gear_ratio;
  const auto increment = static_cast<std::int32_t>(std::lround(2000 * N));
  const auto format = protocol::wire_format(first.quirks.dialect, first.profile.series);
  run.receive(0, {std::chrono::milliseconds(100),
                  protocol::encode_query(1, protocol::Position5{increment}, format)});
  run.receive(0, {std::chrono::milliseconds(100),
                  protocol::encode_query(2, protocol::Position5{-increment}, format)});
  return run;
}

TEST(Double, Experiment) {
  for (const char* motor : {"mg4005", "mg4010", "mg6012-i36", "mg8016", "mf7015", "ms4010"})
    for (const double m : {0.001, 0.01, 0.1, 1.0}) {
      ScenarioRun runs[] = {swing(motor, m, 0.2, kMs), swing(motor, m, 0.2, kMs / 2),
                            swing(motor, m, 0.2, kMs / 4), swing(motor, m, 0.2, 2 * kMs)};
      double apart[4]{};
      double speed = 0;
      double late = 0;
      for (int ms = 102; ms < 1500; ms += 2) {
        for (auto& run : runs) run.advance_to(ms * kMs);
        for (int n = 0; n < 4; ++n) {
          for (int j = 1; j < 3; ++j) {
            apart[n] = std::max(apart[n], std::abs(runs[n].bus(0).truth(j).theta_out -
                                                   runs[2].bus(0).truth(j).theta_out));
            speed = std::max(speed, std::abs(runs[0].bus(0).truth(j).omega_out));
            if (ms > 1300) late = std::max(late, std::abs(runs[0].bus(0).truth(j).omega_out));
          }
        }
      }
      std::printf("%s %g: 2ms %g 1ms %g .5ms %g deg; speed %g late %g\n", motor, m, apart[3] * 57.3,
                  apart[0] * 57.3, apart[1] * 57.3, speed, late);
    }
}

}  // namespace double_test
}  // namespace lk::test
