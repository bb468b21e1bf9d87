#include "model/drive_bank.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "model/block_access.hpp"
#include "model/control/current_loop_params.hpp"
#include "model/drive_bank_state.hpp"
#include "model/plant/faulty_params.hpp"
#include "model/plant/stored_energy.hpp"
#include "model/rounding.hpp"
#include "model/stored_real.hpp"
#include "model/trig.hpp"

namespace lk::model {
namespace {

/// Converts counts to an integer. NaN and values from ±9e18 on, which only impossible motors have,
/// give 0.
std::int64_t whole_counts(double counts) {
  return std::abs(counts) < 9e18 ? static_cast<std::int64_t>(counts) : 0;
}

/// Returns the state of a plant at rest: rotor angle `theta_m`, all parts at `temp` °C, link
/// charged if `connected`.
PlantState<double> plant_at_rest(const DriveParams& p, double theta_m, double temp,
                                 bool connected = true) {
  PlantState<double> s;
  s.theta = theta_m;
  s.theta_out = theta_m / p.mechanics.gear_ratio;
  s.v_link = connected ? p.supply.v_source : 0.0;
  s.temp_winding = s.temp_housing = s.temp_stage = temp;
  return s;
}

/// Returns the encoder reading at rest without noise and non-linearity, counts.
double counts_at(const DriveParams& p, double theta_m) {
  const double seen = p.encoder.direction * theta_m + p.encoder.offset;
  return floored(seen * static_cast<double>(1 << p.encoder.bits) / kTwoPi);
}

constexpr auto kCountsOf = [](const auto& block, std::size_t lane) {
  return lane_of(block.loop.encoder_counts, lane);
};

/// Returns the drive's estimate of its supply current, A: electrical power over link voltage.
/// Without current sensors, i_q follows from R·i_q = v_q − ω·ψ.
double bus_current(const MotionParams& p, const CurrentLoopState<double>& loop, double omega,
                   double v_bus) {
  const double i_q =
      p.has_current_loop ? loop.i_q : (loop.v_q - p.pole_pairs * omega * p.psi_f) / p.R_s;
  return 1.5 * (loop.v_d * loop.i_d + loop.v_q * i_q) / std::max(v_bus, 1.0);
}

}  // namespace

DriveBank::State::State(std::span<const DriveInit> drives, NamedKernel chosen) : kernel(chosen) {
  assert(!drives.empty() && kernel.run != nullptr);
  make_room(drives.size());
  stride = drives.front().params.control.motion_divider;
  for (const DriveInit& init : drives) {
    assert(init.params.inverter.f_pwm == drives.front().params.inverter.f_pwm);
    stride = std::gcd(stride, init.params.control.motion_divider);
    Unit unit;
    unit.params = init.params;
    unit.settings = init.settings;
    settings_changed(unit.settings.protections, unit.protection);
    unit.connected = init.connected;
    if (!init.connected || init.params.supply.v_source < init.params.logic.v_reset) {
      unit.life.life = Life::kInReset;
      unit.setpoint = Off{};
    }
    unit.slow_noise = noise_seed(init.seed ^ 0x510E527FADE682D1U);
    unit.slow_sensors = slow_sensors(init.params.slow_sensor);
    const double temp = init.temp.value_or(init.params.thermal.temp_ambient);
    unit.slow = measure_slowly(unit.slow_sensors, init.params.supply.v_source, {temp, temp, temp},
                               unit.slow_noise);
    const std::size_t drive = units.size();
    units.push_back(unit);
    derive_plant(drive);
    derive_control(drive);
    units[drive].motion =
        motion_state_at(units[drive].motion_params, counts_at(init.params, init.theta_m));
    with_block(drive, [&](auto& block, std::size_t lane) {
      put(block.plant, lane, plant_at_rest(init.params, init.theta_m, temp, init.connected));
      CurrentLoopState<double> loop;
      loop.encoder_counts = counts_at(init.params, init.theta_m);
      put(block.loop, lane, loop);
      put(block.orders, lane, CurrentOrders<double>{});
      block.noise.word[lane] = noise_seed(init.seed);
    });
  }
  fill_spare_lanes();
}

DriveBank::State::State(std::span<const DriveOf> drives)
    : kernel(drives.front().bank->state_->kernel) {
  make_room(drives.size());
  for (const DriveOf& one : drives) take_in(*one.bank->state_, one.drive);
  stride = 0;
  for (const Unit& unit : units) stride = std::gcd(stride, unit.params.control.motion_divider);
  for (TickBlock<Wide>& block : wide) block.faulty = any_faulty(block);
  alone.faulty = any_faulty(alone);
  fill_spare_lanes();
}

void DriveBank::State::make_room(std::size_t count) {
  units.reserve(count);
  if (count > 1) wide.resize((count + kLanes - 1) / kLanes);
}

void DriveBank::State::take_in(const State& other, std::size_t drive) {
  const std::size_t place = units.size();
  units.push_back(other.units[drive]);
  assert(units[place].params.inverter.f_pwm == units.front().params.inverter.f_pwm);
  other.with_block(drive, [&](const auto& from, std::size_t from_lane) {
    with_block(place, [&](auto& to, std::size_t lane) {
      put(to.plant_params, lane, get<PlantParams<double>>(from.plant_params, from_lane));
      put(to.plant, lane, get<PlantState<double>>(from.plant, from_lane));
      put(to.loop_params, lane, get<CurrentLoopParams<double>>(from.loop_params, from_lane));
      put(to.loop, lane, get<CurrentLoopState<double>>(from.loop, from_lane));
      put(to.orders, lane, get<CurrentOrders<double>>(from.orders, from_lane));
      to.noise.word[lane] = from.noise.word[from_lane];
      to.at[lane] = from.at[from_lane];
      to.faults[lane] = from.faults[from_lane];
    });
  });
}

/// The added drives are at rest without load, bridge on. Such a drive causes no infinities and
/// needs no parts of the tick that the other drives do not need.
void DriveBank::State::fill_spare_lanes() {
  DriveParams resting = units.back().params;
  resting.load = LoadParams{};
  for (std::size_t spare = units.size(); spare < wide.size() * kLanes; ++spare) {
    TickBlock<Wide>& block = wide.back();
    CurrentLoopState<double> loop;
    loop.bridge = 1.0;
    CurrentOrders<double> orders;
    orders.bridge_on = 1.0;
    put(block.plant_params, spare % kLanes, plant_params(resting));
    put(block.plant, spare % kLanes, plant_at_rest(resting, 0.0, resting.thermal.temp_ambient));
    put(block.loop_params, spare % kLanes, current_loop_params(resting, units.back().settings));
    put(block.loop, spare % kLanes, loop);
    put(block.orders, spare % kLanes, orders);
  }
}

DriveBank::DriveBank(std::span<const DriveInit> drives, NamedKernel kernel)
    : state_(std::make_unique<State>(drives, kernel)) {}
DriveBank::DriveBank(std::span<const DriveOf> drives) : state_(std::make_unique<State>(drives)) {}
DriveBank::DriveBank(const DriveBank& other) : state_(std::make_unique<State>(*other.state_)) {}
DriveBank::DriveBank(DriveBank&& other) noexcept = default;
DriveBank& DriveBank::operator=(DriveBank other) noexcept {
  state_ = std::move(other.state_);
  return *this;
}
DriveBank::~DriveBank() = default;

std::size_t DriveBank::size() const { return state_->units.size(); }

std::int64_t DriveBank::ticks(std::optional<std::size_t> one) const {
  if (one) {
    return state_->with_block(*one,
                              [](const auto& block, std::size_t lane) { return block.at[lane]; });
  }
  std::int64_t least = ticks(0);
  for (std::size_t drive = 1; drive < state_->units.size(); ++drive) {
    least = std::min(least, ticks(drive));
  }
  return least;
}

double DriveBank::State::source_voltage(const Unit& unit, const Faults& faults) {
  if (!unit.connected || faults.supply_cut) return 0.0;
  const double left = std::max(unit.params.supply.v_source - unit.supply_drop, 0.0);
  return std::min(left, faults.v_source_max);
}

PlantParams<double> DriveBank::State::plant_of(const Unit& unit, const Faults& faults) {
  DriveParams params = with_faults(unit.params, faults);
  if (unit.mounted) params.load.J = unit.params.load.J;
  params.supply.v_source = source_voltage(unit, faults);
  if (!unit.connected || faults.supply_cut) {  // source of 0 V that accepts no current
    params.supply.i_regen_max = 0.0;
  }
  params.mechanics.tau_coulomb += params.brake.tau * unit.brake.pressed;
  params.mechanics.tau_static += params.brake.tau * unit.brake.pressed;
  PlantParams<double> plant = plant_params(params, !faults.coupling_broken);
  set_iron(plant, unit.params.mechanics);
  return plant;
}

void DriveBank::State::derive_plant(std::size_t drive) {
  const Unit& unit = units[drive];
  with_block(drive, [&](auto& block, std::size_t lane) {
    put(block.plant_params, lane, plant_of(unit, unit.faults));
  });
}

void DriveBank::State::derive_control(std::size_t drive) {
  Unit& unit = units[drive];
  const DriveParams params = by_own_clock(unit.params, unit.faults);
  unit.motion_params = motion_params(params, unit.settings);
  with_block(drive, [&](auto& block, std::size_t lane) {
    CurrentLoopParams<double> loop = current_loop_params(params, unit.settings);
    loop.rad_e_offset -= unit.faults.commutation_offset;
    put(block.loop_params, lane, loop);
  });
}

void DriveBank::State::run_firmware(std::size_t drive) {
  Unit& unit = units[drive];
  const double T_m = unit.motion_params.T_m;  // s of the drive's clock
  if (unit.params.brake.tau > 0.0 && move_brake(unit.params.brake, T_m / unit.faults.clock_ratio,
                                                unit.brake, unit.faults.brake_delay)) {
    derive_plant(drive);
    stopped = true;  // the kernel must load the new plant parameters
  }
  const double v_link = with_block(
      drive, [](const auto& block, std::size_t lane) { return lane_of(block.plant.v_link, lane); });
  if (live(unit.params.logic, v_link, T_m, unit.life)) {
    edge = stopped = true;
    unit.life.life == Life::kAlive ? restart(drive) : die(drive);
  }
  if (unit.life.life == Life::kAlive) {
    run_motion_loops(drive);
  }
}

/// Opens all switches of the bridge and switches the brake coil off, as without a controller.
void DriveBank::State::die(std::size_t drive) {
  Unit& unit = units[drive];
  unit.setpoint = Off{};
  unit.brake.switch_coil(false);
  with_block(drive, [](auto& block, std::size_t lane) {
    put(block.orders, lane, CurrentOrders<double>{});
  });
}

void DriveBank::State::restart(std::size_t drive) {
  Unit& unit = units[drive];
  unit.protection = {};
  settings_changed(unit.settings.protections, unit.protection);
  unit.motion = motion_state_at(unit.motion_params, with_block(drive, kCountsOf));
  unit.setpoint = Idle{};
}

void DriveBank::restart(std::size_t drive) { state_->restart(drive); }

void DriveBank::State::run_motion_loops(std::size_t drive) {
  Unit& unit = units[drive];
  with_block(drive, [&](auto& block, std::size_t lane) {
    const double i_a = lane_of(block.loop.i_a, lane);
    const double i_b = lane_of(block.loop.i_b, lane);
    unit.slow = measure_slowly(
        unit.slow_sensors, lane_of(block.plant.v_link, lane),
        {lane_of(block.plant.temp_winding, lane), lane_of(block.plant.temp_housing, lane),
         lane_of(block.plant.temp_stage, lane)},
        unit.slow_noise);
    if (unit.slow_sensors_faulty) {
      unit.slow = falsified(unit.slow_sensors, unit.faults, unit.slow);
    }
    const double i_peak = std::max({std::abs(i_a), std::abs(i_b), std::abs(i_a + i_b)});
    const Watched watched{unit.slow.v_bus,
                          unit.slow.temp_motor,
                          unit.slow.temp_driver,
                          i_peak,
                          near_limit(unit.motion_params, unit.motion, unit.slow.v_bus,
                                     lane_of(block.loop.i_q, lane), lane_of(block.loop.v_q, lane)),
                          unit.motion.omega_report};
    watch(unit.settings.protections, watched, unit.motion_params.T_m, unit.protection);
    if (unit.protection.latched != 0) {
      unit.setpoint = Off{};
    }
    CurrentOrders<double> orders;
    motion_loops(unit.motion_params, unit.setpoint, lane_of(block.loop.encoder_counts, lane),
                 unit.slow.v_bus, unit.motion, orders);
    put(block.orders, lane, orders);
  });
}

[[gnu::flatten]] bool DriveBank::State::give_orders(void* block_drives, std::size_t first,
                                                    std::size_t count, std::int64_t tick) {
  const BlockDrives& drives = *static_cast<const BlockDrives*>(block_drives);
  State& bank = *drives.bank;
  const std::size_t end = std::min(drives.begin + first + count, bank.units.size());
  bank.stopped = false;
  for (std::size_t drive = drives.begin + first; drive < end; ++drive) {
    const int divider = bank.units[drive].params.control.motion_divider;
    if (divider == bank.stride || tick % divider == 0) {
      bank.run_firmware(drive);
    }
  }
  return bank.stopped;
}

void DriveBank::advance(std::int64_t n_ticks) {
  const std::int64_t until = ticks() + n_ticks;
  while (advance_to_edge(until)) {
  }
}

bool DriveBank::advance_to_edge(std::int64_t until, std::optional<std::size_t> only) {
  if (only) return state_->advance_to_edge(until, *only);
  // Advances block by block over the whole time, so that each block stays in the cache. Drives do
  // not influence each other.
  bool edge = false;
  for (std::size_t drive = 0; drive < state_->units.size(); drive += state_->kernel.width) {
    edge = state_->advance_to_edge(until, drive) || edge;
  }
  return edge;
}

bool DriveBank::State::advance_to_edge(std::int64_t until, std::size_t drive) {
  edge = false;
  BlockDrives drives{this, drive - drive % kLanes};
  Stretch stretch{until, stride, give_orders, &drives};
  const auto run = [&](auto& block, auto tick_kernel) {
    // Continues after a stretch that ended early, unless the caller has to handle an edge first.
    while (!edge && block.at[stretch.drive] < until) {
      tick_kernel(block, stretch);
    }
  };
  if (wide.empty()) {
    run(alone, alone.faulty ? run_alone_faulty : kernel.run_single);
  } else {
    TickBlock<Wide>& block = wide[drive / kLanes];
    stretch.drive = drive % kLanes;
    stretch.drive -= stretch.drive % kernel.width;
    run(block, block.faulty ? kernel.run_faulty : kernel.run);
  }
  return edge;
}

const DriveInputs& DriveBank::inputs(std::size_t drive) const { return state_->units[drive]; }

bool DriveBank::alive(std::size_t drive) const {
  return state_->units[drive].life.life == Life::kAlive;
}

void DriveBank::command(std::size_t drive, const Setpoint& setpoint) {
  State::Unit& unit = state_->units[drive];
  setpoint_changed(unit.motion_params, unit.setpoint, setpoint,
                   state_->with_block(drive, kCountsOf), unit.motion);
  unit.setpoint = setpoint;
}

void DriveBank::configure(std::size_t drive, const ControlSettings& settings) {
  State::Unit& unit = state_->units[drive];
  const bool had_no_ramp = unit.motion_params.accel_max == 0.0;
  unit.settings = settings;
  settings_changed(settings.protections, unit.protection);
  state_->derive_control(drive);
  if (had_no_ramp && unit.motion_params.accel_max > 0.0) {
    // Without a ramp, the references were at the target. The new ramp starts at the shaft's state,
    // as if the setpoint were commanded now.
    unit.motion.omega_ref = unit.motion.omega_hat;
    setpoint_changed(unit.motion_params, Speed{}, unit.setpoint,
                     state_->with_block(drive, kCountsOf), unit.motion);
  }
}

void DriveBank::clear_errors(std::size_t drive) {
  model::clear_errors(state_->units[drive].settings.protections, state_->units[drive].protection);
}
void DriveBank::feed_input(std::size_t drive) {
  model::feed_input(state_->units[drive].protection);
}

void DriveBank::set_load(std::size_t drive, const LoadParams& load) {
  state_->units[drive].params.load = load;
  state_->derive_plant(drive);
}
void DriveBank::set_supply_voltage(std::size_t drive, double v_source) {
  state_->units[drive].params.supply.v_source = v_source;
  state_->derive_plant(drive);
}
void DriveBank::set_supply_drop(std::size_t drive, double v_drop) {
  State::Unit& unit = state_->units[drive];
  unit.supply_drop = v_drop;
  // Updates only this parameter: deriving all of them on every call is too slow.
  const double v_source = State::source_voltage(unit, unit.faults);
  state_->with_block(drive, [&](auto& block, std::size_t lane) {
    lane_of(block.plant_params.v_source, lane) = v_source;
  });
}
void DriveBank::connect_supply(std::size_t drive, bool connected) {
  state_->units[drive].connected = connected;
  state_->derive_plant(drive);
}
void DriveBank::set_brake_coil(std::size_t drive, bool on) {
  State::Unit& unit = state_->units[drive];
  unit.brake.switch_coil(on && unit.life.life == Life::kAlive);
}
void DriveBank::turn_shaft(std::size_t drive, double angle) {
  State::Unit& unit = state_->units[drive];
  const LoadParams load = with_faults(unit.params, unit.faults).load;
  state_->with_block(drive, [&](auto& block, std::size_t lane) {
    double& theta_out = lane_of(block.plant.theta_out, lane);
    const double before = theta_out;
    theta_out = std::clamp(theta_out + angle, std::min(load.theta_min, before),
                           std::max(load.theta_max, before));
    if (unit.faults.coupling_broken) {
      return;
    }
    const double turn = (theta_out - before) * unit.params.mechanics.gear_ratio;
    lane_of(block.plant.theta, lane) += turn;
    if (unit.faults.encoder != EncoderFault::kNone) {
      return;
    }
    // A hand turns the shaft slowly: the encoder follows, and the estimator sees no speed.
    lane_of(block.loop.encoder_counts, lane) += nearest(turn * unit.motion_params.counts_per_rad);
    accept_encoder_jump(unit.motion_params, lane_of(block.loop.encoder_counts, lane), unit.motion);
  });
}
void DriveBank::set_ambient_temperature(std::size_t drive, double temp_ambient) {
  state_->units[drive].params.thermal.temp_ambient = temp_ambient;
  state_->derive_plant(drive);
}

Telemetry DriveBank::telemetry(std::size_t drive) const {
  const State::Unit& unit = state_->units[drive];
  return state_->with_block(drive, [&](const auto& block, std::size_t lane) {
    const auto loop = get<CurrentLoopState<double>>(block.loop, lane);
    Telemetry t;
    t.temp_motor = unit.slow.temp_motor;
    t.temp_driver = unit.slow.temp_driver;
    t.v_bus = unit.slow.v_bus;
    t.i_bus = bus_current(unit.motion_params, loop, unit.motion.omega_hat, unit.slow.v_bus);
    t.i_q = loop.i_q;
    // `+ 0.0` turns −0.0 into 0.0: the sign of a zero voltage depends on the compiler.
    t.power = loop.v_q / (unit.motion_params.modulation * std::max(unit.slow.v_bus, 1.0)) + 0.0;
    t.i_a = loop.i_a;
    t.i_b = loop.i_b;
    t.i_c = -loop.i_a - loop.i_b;
    t.omega = unit.motion.omega_report;
    t.encoder_position = whole_counts(loop.encoder_counts);
    t.errors = unit.protection.latched;
    t.bridge_on = !std::holds_alternative<Off>(unit.setpoint);
    t.alive = unit.life.life == Life::kAlive;
    return t;
  });
}

Truth DriveBank::truth(std::size_t drive) const {
  const State::Unit& unit = state_->units[drive];
  return state_->with_block(drive, [&](const auto& block, std::size_t lane) {
    const auto s = get<PlantState<double>>(block.plant, lane);
    const auto loop = get<CurrentLoopState<double>>(block.loop, lane);
    Truth t;
    t.theta_m = s.theta;
    t.omega_m = s.omega;
    t.theta_out = s.theta_out;
    t.omega_out = s.omega_out;
    t.i_d = s.i_d;
    t.i_q = s.i_q;
    t.tau_e = s.tau_e;
    t.v_bus = s.v_link;
    t.temp_winding = s.temp_winding;
    t.temp_housing = s.temp_housing;
    t.temp_stage = s.temp_stage;
    t.i_q_ref = unit.motion.i_q_ref;
    t.omega_ref = unit.motion.omega_ref;
    t.theta_ref = unit.motion.theta_ref;
    t.duty_abc = {loop.duty_a, loop.duty_b, loop.duty_c};
    return t;
  });
}

EnergyLedger DriveBank::energy(std::size_t drive) const {
  return state_->with_block(drive, [](const auto& block, std::size_t lane) {
    const auto p = get<PlantParams<double>>(block.plant_params, lane);
    const auto s = get<PlantState<double>>(block.plant, lane);
    return EnergyLedger{s.p_supply * p.T_s,   s.p_copper * p.T_s, s.p_inverter * p.T_s,
                        s.p_friction * p.T_s, s.p_gear * p.T_s,   s.p_load * p.T_s,
                        stored_energy(p, s)};
  });
}

}  // namespace lk::model
