#pragma once

/// @file Sensors read at the motion-loop rate: link voltage and temperatures (docs/model.md §7).

#include <cmath>

#include "model/drive_params.hpp"
#include "model/noise.hpp"

namespace lk::model {

struct SlowMeasurement {
  double v_bus = 0;        // V
  double temp_motor = 0;   // °C, at the winding
  double temp_driver = 0;  // °C, at the power stage
};

/// `lsb` > 0: the step of the converter.
inline double quantised(double x, double lsb) { return nearest(x / lsb) * lsb; }

inline SlowMeasurement measure_slowly(const SlowSensorParams& p, double v_link, double temp_winding,
                                      double temp_stage, std::uint64_t& noise) {
  return {quantised(v_link + p.v_noise * normal_deviate(noise), p.v_lsb),
          quantised(temp_winding, p.temp_lsb), quantised(temp_stage, p.temp_lsb)};
}

}  // namespace lk::model
