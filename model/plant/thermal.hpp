#pragma once

/// @file Heat: winding → housing → ambient; board with power stage → ambient
/// (docs/internals/model.md §6). Sensors read at the motion-loop rate: link voltage and
/// temperatures (§7).

#include <cmath>

#include "model/drive_params.hpp"
#include "model/faults.hpp"
#include "model/noise.hpp"
#include "model/plant/plant_params.hpp"
#include "model/rounding.hpp"

namespace lk::model {

template <class Real>
struct Temperatures {
  Real winding, housing, stage;  // °C
};

/// Heat flow into each node, W.
template <class Real>
struct Heat {
  Real winding, housing, stage;
};

/// °C, highest temperature of the housing (assumed): parts whose friction heats it further burn.
inline constexpr double kHottestHousing = 300.0;

inline namespace LKEMU_ISA {

/// One explicit Euler step; the fastest time constant is seconds, the period tens of microseconds.
template <class Real>
inline Temperatures<Real> thermal(const PlantParams<Real>& p, const Temperatures<Real>& t,
                                  const Heat<Real>& given) {
  const Real to_housing = (t.winding - t.housing) * p.g_winding_housing;
  const Real to_ambient = (t.housing - p.temp_ambient) * p.g_housing_ambient;
  const Real from_stage = (t.stage - p.temp_ambient) * p.g_stage_ambient;
  const Real housing = t.housing + (given.housing + to_housing - to_ambient) * p.heat_housing;
  return {t.winding + (given.winding - to_housing) * p.heat_winding,
          min(housing, Real(kHottestHousing)), t.stage + (given.stage - from_stage) * p.heat_stage};
}

}  // namespace LKEMU_ISA

struct SlowMeasurement {
  double v_bus = 0;        // V
  double temp_motor = 0;   // °C, of the winding, measured on the board
  double temp_driver = 0;  // °C, at the power stage
};

/// Noise and steps of the ADCs, with the inverses of the steps.
struct SlowSensors {
  double v_noise, v_lsb, inv_v_lsb, temp_lsb, inv_temp_lsb, board_share;
};

inline SlowSensors slow_sensors(const SlowSensorParams& p) {
  return {p.v_noise, p.v_lsb, 1.0 / p.v_lsb, p.temp_lsb, 1.0 / p.temp_lsb, p.board_share};
}

inline SlowMeasurement measure_slowly(const SlowSensors& p, double v_link,
                                      const Temperatures<double>& temp, std::uint64_t& noise) {
  // The ADC cannot read below zero: noise at an empty link must not give a negative voltage.
  const double v_seen = max(v_link + p.v_noise * normal_deviate(noise), 0.0);
  const double temp_motor = temp.winding + p.board_share * (temp.stage - temp.housing);
  return {nearest(v_seen * p.inv_v_lsb) * p.v_lsb,
          nearest(temp_motor * p.inv_temp_lsb) * p.temp_lsb,
          nearest(temp.stage * p.inv_temp_lsb) * p.temp_lsb};
}

/// Returns true if a fault affects these sensors.
inline bool slow_sensors_faulty(const Faults& f) {
  return f.v_bus_stuck || f.temp_motor_stuck || f.temp_driver_stuck || f.v_bus_offset != 0.0 ||
         f.temp_motor_offset != 0.0 || f.temp_driver_offset != 0.0;
}

/// Returns the readings with these faults.
inline SlowMeasurement falsified(const SlowSensors& p, const Faults& f,
                                 const SlowMeasurement& healthy) {
  const auto quantised = [](double x, double lsb, double inv_lsb) {
    return nearest(x * inv_lsb) * lsb;
  };
  const double v_bus = max(f.v_bus_stuck.value_or(healthy.v_bus + f.v_bus_offset), 0.0);
  return {quantised(v_bus, p.v_lsb, p.inv_v_lsb),
          quantised(f.temp_motor_stuck.value_or(healthy.temp_motor + f.temp_motor_offset),
                    p.temp_lsb, p.inv_temp_lsb),
          quantised(f.temp_driver_stuck.value_or(healthy.temp_driver + f.temp_driver_offset),
                    p.temp_lsb, p.inv_temp_lsb)};
}

}  // namespace lk::model
