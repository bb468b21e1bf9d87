// DriveBank::takes_effect reports whether a fault changes anything (docs/internals/model.md §14).
#include "model/fault_effects.hpp"

#include "tests/model/support.hpp"

namespace lk::model::test {
namespace fault_effects_test {

/// Returns a drive with some of every effect after running `setpoint` for a while.
DriveBank drive_at(const Setpoint& setpoint, const Faults& in_force = {}) {
  DriveParams d = ideal_drive();
  d.mechanics.tau_coulomb = 0.01;
  d.mechanics.tau_static = 0.012;
  d.mechanics.B = 1e-5;
  d.supply.i_logic = 0.05;
  d.supply.R_source = 0.05;
  d.logic.v_reset = 6.0;
  d.current_sensor.bits = 12;  // steps of 16 mA: half an encoder count makes 2 mA in phase a
  DriveBank bank = one_drive(d);
  bank.command(0, Off{});
  bank.advance(3200);
  bank.set_faults(0, in_force);
  bank.command(0, setpoint);
  bank.advance(6400);
  return bank;
}

bool effective(const DriveBank& bank, const Faults& one) { return bank.takes_effect(0, one); }

TEST(TakesEffect, NeverWithoutFaults) {
  for (const Setpoint& setpoint : {Setpoint{Off{}}, Setpoint{Torque{3.0}}, Setpoint{Speed{40.0}}}) {
    EXPECT_FALSE(effective(drive_at(setpoint), {}));
    EXPECT_FALSE(
        effective(drive_at(setpoint, {.encoder = EncoderFault::kGarbage, .jam = 0.3}), {}));
  }
}

TEST(TakesEffect, StuckEncoderOnceTheShaftHasMoved) {
  const Faults stuck{.encoder = EncoderFault::kStuck};
  DriveBank bank = drive_at(Off{}, stuck);
  EXPECT_FALSE(effective(bank, stuck));
  bank.turn_shaft(0, 2e-6);  // less than a count of 18 bits, 2.4e-5 rad
  EXPECT_FALSE(effective(bank, stuck));
  bank.turn_shaft(0, 5e-5);
  EXPECT_TRUE(effective(bank, stuck));
  EXPECT_TRUE(effective(bank, {.encoder = EncoderFault::kGarbage}));
  EXPECT_TRUE(effective(bank, {.encoder = EncoderFault::kLostMagnet}));
}

TEST(TakesEffect, SensorsIfTheReadingChangesByAStep) {
  const DriveBank off = drive_at(Off{});
  EXPECT_TRUE(effective(off, {.encoder_offset = 1e-3}));
  EXPECT_FALSE(effective(off, {.encoder_latency = 1e-3}));  // no motion
  EXPECT_TRUE(effective(off, {.encoder_noise = 1e-4}));
  EXPECT_FALSE(effective(off, {.encoder_noise = 1e-7}));
  EXPECT_FALSE(effective(off, {.current_a = {.gain = 0.5}}));  // no current
  EXPECT_FALSE(effective(off, {.current_a = {.stuck = 0.0}}));
  EXPECT_TRUE(effective(off, {.current_b = {.stuck = 1.0}}));
  EXPECT_TRUE(effective(off, {.current_b = {.offset = 0.1}}));
  EXPECT_FALSE(effective(off, {.current_b = {.offset = 1e-6}}));
  EXPECT_TRUE(effective(off, {.current_noise = 0.1}));
  EXPECT_TRUE(effective(off, {.v_bus_stuck = 12.0}));
  EXPECT_FALSE(effective(off, {.temp_motor_stuck = 25.1}));  // 25.0 in steps of half a kelvin
  EXPECT_TRUE(effective(off, {.temp_driver_stuck = 26.0}));
  EXPECT_FALSE(effective(off, {.temp_driver_offset = 0.1}));
  EXPECT_TRUE(effective(off, {.v_bus_offset = -0.01}));

  const DriveBank running = drive_at(Speed{40.0});
  EXPECT_TRUE(effective(running, {.encoder_latency = 1e-3}));
  EXPECT_FALSE(effective(running, {.encoder_latency = 1e-8}));
  const DriveBank pushing = drive_at(Torque{10.0}, {.jam = 1.0});
  EXPECT_TRUE(
      effective(pushing, {.current_b = {.gain = 0.5}}));  // at angle 0 the q axis is b and c
  EXPECT_FALSE(effective(pushing, {.current_a = {.gain = 0.5}}));
}

TEST(TakesEffect, NoSensorWithoutPower) {
  DriveBank bank = drive_at(Off{});
  bank.set_supply_voltage(0, 3.0);
  bank.advance(3200);
  ASSERT_FALSE(bank.alive(0));
  EXPECT_FALSE(effective(bank, {.v_bus_stuck = 12.0}));
  EXPECT_FALSE(effective(bank, {.encoder_offset = 1.0}));
  EXPECT_FALSE(effective(bank, {.clock_ratio = 2.0}));
}

TEST(TakesEffect, StageIfItWouldCarryCurrent) {
  const Faults dead{.bridge_dead = true};
  const Faults open_a{.legs = {LegFault::kPhaseOpen}};
  const Faults open_b{.legs = {LegFault::kNone, LegFault::kPhaseOpen}};
  const DriveBank off = drive_at(Off{});
  for (const LegFault fault : {LegFault::kPhaseOpen, LegFault::kHighOpen, LegFault::kLowOpen,
                               LegFault::kHighShorted, LegFault::kLowShorted}) {
    EXPECT_FALSE(effective(off, {.legs = {fault}}));
  }
  EXPECT_FALSE(effective(off, dead));
  // Locked at angle 0, the q axis lies between b and c: a carries nothing, b current into the
  // motor.
  const DriveBank pushing = drive_at(Torque{5.0}, {.jam = 1.0});
  EXPECT_TRUE(effective(pushing, dead));
  EXPECT_FALSE(effective(pushing, open_a));
  EXPECT_TRUE(effective(pushing, open_b));
  EXPECT_TRUE(effective(pushing, {.legs = {LegFault::kNone, LegFault::kHighOpen}}));
  EXPECT_TRUE(effective(pushing, {.legs = {LegFault::kNone, LegFault::kNone, LegFault::kLowOpen}}));
  EXPECT_TRUE(effective(pushing, {.legs = {LegFault::kHighShorted}}));
  // The fault has removed the current; without it the current would return.
  EXPECT_TRUE(effective(drive_at(Torque{5.0}, {.bridge_dead = true, .jam = 1.0}), dead));
  EXPECT_TRUE(effective(drive_at(Torque{5.0}, {.legs = open_b.legs, .jam = 1.0}), open_b));
  // A shorted switch brakes a shaft turned by hand.
  DriveBank turned = drive_at(Off{});
  turned.kick(0, 933e-7 * 60.0);
  EXPECT_FALSE(effective(turned, open_a));
  EXPECT_TRUE(effective(turned, {.legs = {LegFault::kHighShorted}}));
}

TEST(TakesEffect, MechanicsIfTheMotionDiffers) {
  const DriveBank off = drive_at(Off{});
  const DriveBank running = drive_at(Speed{40.0});
  const DriveBank held = drive_at(Torque{0.05});  // 5 mNm, less than its own friction
  for (const Faults& fault : {Faults{.jam = 0.2}, Faults{.friction = 2.0}, Faults{.jam = 1.0}}) {
    EXPECT_FALSE(effective(off, fault));
    EXPECT_FALSE(effective(held, fault));
    EXPECT_TRUE(effective(running, fault));
  }
  EXPECT_TRUE(effective(drive_at(Torque{3.0}, {.jam = 1.0}), {.jam = 1.0}));
  EXPECT_FALSE(effective(drive_at(Torque{0.05}, {.jam = 1.0}), {.jam = 1.0}));
  EXPECT_FALSE(effective(off, {.inertia = 2.0}));
  DriveBank accelerating = drive_at(Off{});
  accelerating.command(0, Torque{5.0});
  accelerating.advance(100);
  EXPECT_TRUE(effective(accelerating, {.inertia = 2.0}));
  EXPECT_FALSE(effective(running, {.backlash = 5.0}));  // a rigid gear has no play
  EXPECT_FALSE(effective(off, {.coupling_broken = true}));
  EXPECT_TRUE(effective(off, {.load_torque = 1.0}));
  EXPECT_FALSE(effective(off, {.load_torque = 1e-6}));  // friction still holds the shaft
  EXPECT_FALSE(effective(running, {.theta_max = 1e6}));
  const Faults stop{.theta_max = 0.5};
  DriveBank stopped = drive_at(Torque{2.0}, stop);
  ASSERT_EQ(stopped.truth(0).theta_out, 0.5);
  EXPECT_TRUE(effective(stopped, stop));
  EXPECT_FALSE(effective(stopped, {.theta_max = 0.6}));
  stopped.command(0, Torque{-2.0});
  stopped.advance(3200);
  EXPECT_FALSE(effective(stopped, stop));
}

TEST(TakesEffect, BrokenCouplingOnceTheAnglesDiffer) {
  DriveParams d = ideal_drive();
  d.load.J = 1e-3;
  const Faults broken{.coupling_broken = true};
  DriveBank driven = one_drive(d);
  driven.set_faults(0, broken);
  driven.advance(100);
  EXPECT_FALSE(effective(driven, broken));
  DriveBank turned = driven;
  driven.command(0, Speed{5.0});
  driven.advance(1000);
  EXPECT_TRUE(effective(driven, broken));
  EXPECT_GT(driven.truth(0).theta_m, driven.truth(0).theta_out);

  turned.command(0, Off{});
  turned.turn_shaft(0, 0.3);  // the output only; the rotor stays
  turned.advance(100);
  EXPECT_EQ(turned.truth(0).theta_out, 0.3);
  EXPECT_EQ(turned.truth(0).theta_m, 0.0);
  EXPECT_EQ(turned.telemetry(0).encoder_position, 0);
  EXPECT_TRUE(effective(turned, broken));  // without the fault, both would have equal angles
}

TEST(TakesEffect, BacklashIfHealthyTeethWouldTouch) {
  DriveParams d = ideal_drive();
  d.mechanics.gear_ratio = 6.0;
  d.mechanics.backlash_out = 0.02;
  d.mechanics.gear_stiffness_out = 400.0;
  d.mechanics.gear_damping_out = 0.3;
  d.mechanics.J_out = 5e-4;
  DriveBank bank = one_drive(d);
  const Faults worn{.backlash = 3.0};
  bank.set_faults(0, {.jam = 1.0, .backlash = 3.0});
  bank.advance(100);
  EXPECT_FALSE(effective(bank, worn));
  bank.command(0, Torque{0.3});
  bank.advance(6400);
  EXPECT_TRUE(effective(bank, worn));
}

TEST(TakesEffect, PowerIfTheLinkVoltageDiffers) {
  const DriveBank off = drive_at(Off{});
  EXPECT_FALSE(effective(off, {.v_source_max = 24.0}));
  EXPECT_TRUE(effective(off, {.v_source_max = 20.0}));
  EXPECT_TRUE(effective(drive_at(Off{}, {.v_source_max = 20.0}), {.v_source_max = 20.0}));
  EXPECT_TRUE(effective(drive_at(Off{}, {.supply_cut = true}), {.supply_cut = true}));
  EXPECT_FALSE(effective(off, {.no_regeneration = true}));
  DriveBank braking = drive_at(Speed{60.0});
  braking.set_faults(0, {.no_regeneration = true});
  EXPECT_FALSE(effective(braking, {.no_regeneration = true}));
  braking.command(0, Speed{0.0});
  braking.advance(320);
  EXPECT_GT(braking.truth(0).v_bus, 24.2);
  EXPECT_TRUE(effective(braking, {.no_regeneration = true}));
}

TEST(TakesEffect, WrongClockIfTimeMatters) {
  EXPECT_FALSE(effective(drive_at(Off{}), {.clock_ratio = 1.01}));
  EXPECT_TRUE(effective(drive_at(Speed{10.0}), {.clock_ratio = 1.01}));
  EXPECT_FALSE(effective(drive_at(Speed{10.0}), {.clock_ratio = 1.0}));
}

TEST(TakesEffect, WorseCoolingIfTheHousingIsWarmerThanTheAir) {
  const Faults hotter{.R_housing_ambient = 2.0};
  DriveBank bank = drive_at(Off{});
  EXPECT_FALSE(effective(bank, hotter));
  bank.set_ambient_temperature(0, 24.999);  // of 3 K/W, half: 0.2 mW
  EXPECT_FALSE(effective(bank, hotter));
  bank.set_ambient_temperature(0, 24.9);  // 17 mW
  EXPECT_TRUE(effective(bank, hotter));
  bank.set_supply_voltage(0, 0.0);
  bank.advance(32000);
  EXPECT_FALSE(bank.alive(0));
  EXPECT_TRUE(effective(bank, hotter)) << "without power too";
}

/// Blocks the heat path from a warm winding to the housing: 55 K above a healthy drive.
TEST(TakesEffect, BlockedHeatPathIfTheWindingIsWarm) {
  DriveParams healthy = ideal_drive();
  healthy.thermal.R_winding_housing = 1.0;
  healthy.thermal.C_winding = 50.0;
  DriveParams blocked = healthy;
  blocked.thermal.R_winding_housing = 100.0;
  const PlantParams<double> a = plant_params(blocked);
  const PlantParams<double> b = plant_params(healthy);
  PlantState<double> state;
  state.v_link = 24;
  state.temp_housing = state.temp_stage = 25;
  const CurrentLoopState<double> loop;
  const LaneFaults none;
  for (const double winding_C : {80.0, 25.0}) {
    state.temp_winding = winding_C;
    EXPECT_EQ(plants_differ({a, state, loop, none}, {b, state, loop, none}, slow_sensors({})),
              winding_C > 25);
  }
}

}  // namespace fault_effects_test
}  // namespace lk::model::test
