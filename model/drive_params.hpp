#pragma once

/// @file Parameters of one drive in SI units, as a motor profile states them.
///
/// Symbols are those of docs/internals/model.md. Angles (rad) and speeds (rad/s) are those of the
/// *rotor*, unless a name contains `_out` (behind the gear). `configs/motors/` gives the source of
/// every number.

namespace lk::model {

/// Permanent-magnet synchronous machine in amplitude-invariant dq coordinates. The d axis is that
/// of the magnet flux.
struct MotorParams {
  int pole_pairs = 14;         // 1..64
  double R_s = 0.14;           // Ω, phase, at 25 °C
  double L_d = 0.12e-3;        // H
  double L_q = 0.12e-3;        // H
  double psi_f = 0.00499;      // Wb, at 25 °C
  double alpha_cu = 0.00393;   // 1/K, copper
  double alpha_pm = -0.0011;   // 1/K, magnet
  double torque_ripple = 0.0;  // 0..0.1: amplitude / mean of the torque, 6 per electrical turn
};

/// Three half bridges and their timer.
struct InverterParams {
  double f_pwm = 32e3;         // Hz, also the rate of the current loop
  double t_dead = 200e-9;      // s
  double R_on = 10e-3;         // Ω, one switch
  double v_diode = 0.8;        // V, body diode
  double timer_counts = 2625;  // per half period; the duty's resolution is 1/timer_counts
  double duty_max = 0.98;      // largest duty of a leg; the smallest is 1 − duty_max
  double i_dead_zone = 0.1;  // A, > 0: below it the dead-time voltage error fades linearly to zero
};

struct MechanicsParams {
  double J = 933e-7;                // kg·m², rotor
  double gear_ratio = 1.0;          // rotor turns per output turn
  double gear_efficiency = 1.0;     // 0..1 at full load, either direction
  double backlash_out = 0.0;        // rad at the output, total play
  double gear_stiffness_out = 0.0;  // Nm/rad at the output; 0 = rigid coupling without play
  double gear_damping_out = 0.0;    // Nm·s/rad at the output, while the teeth touch
  double J_out = 0.0;               // kg·m², output flange; > 0 if gear_stiffness_out > 0
  double tau_coulomb_out = 0.0;     // Nm at the output, seals and bearings behind the gear
  double tau_coulomb = 0.0;         // Nm
  double tau_static = 0.0;          // Nm, break-away torque, ≥ tau_coulomb
  double omega_stribeck = 1.0;    // rad/s, at which tau_static − tau_coulomb has fallen to a half
  double B = 0.0;                 // Nm·s/rad, viscous
  double hysteresis_share = 0.0;  // 0..1 of tau_coulomb: lost in the stator's iron
  double eddy_share = 0.0;        // 0..1 of B: lost in the stator's iron
  // Cogging: −tau_cogging·sin(n·θ + phase), n = cogging_per_turn, and its third harmonic; and
  // −tau_pole_cogging·sin(2·pole_pairs·θ + phase).
  double tau_cogging = 0.0;         // Nm, amplitude
  int cogging_per_turn = 84;        // periods per rotor turn
  double tau_cogging_3 = 0.0;       // Nm, amplitude of the third harmonic
  double cogging_phase = 0.0;       // rad
  double tau_pole_cogging = 0.0;    // Nm, amplitude
  double pole_cogging_phase = 0.0;  // rad
};

/// Angle of an end stop that does not exist: no shaft gets there.
inline constexpr double kNoStop = 1e9;  // rad

/// Load on the output shaft; can be changed while running.
struct LoadParams {
  double J = 0.0;            // kg·m², at the output
  double tau = 0.0;          // Nm at the output, constant; > 0: clockwise (towards larger angles)
  double tau_gravity = 0.0;  // Nm, m·g·l of an arm: the torque is −tau_gravity·sin(theta_out)
  double theta_min = -kNoStop;  // rad at the output, hard end stops
  double theta_max = kNoStop;
};

struct SupplyParams {
  double v_source = 24.0;    // V, can be changed while running
  double R_source = 0.05;    // Ω
  double C_link = 470e-6;    // F
  double i_regen_max = 1e3;  // A, largest current into the source; 0 = a rectifier
  double i_logic = 0.0;      // A at 24 V, drawn from the link by the drive's electronics
};

/// Voltage limits and boot time of the drive's controller.
struct LogicParams {
  double v_reset = 5.0;             // V at the link, below it the controller is in reset
  double v_reset_hysteresis = 0.5;  // V; the controller starts at v_reset + v_reset_hysteresis
  double boot_time = 0.05;          // s from the start of the controller until it answers
};

/// Power-off brake on the rotor: a spring engages the brake, a coil releases it.
struct BrakeParams {
  double tau = 0.0;            // Nm at the rotor; 0 = none fitted
  double engage_time = 0.02;   // s from coil off to full torque
  double release_time = 0.03;  // s from coil on to no torque
};

/// Thermal model: the motor has two bodies (winding, housing), the power stage is one. Housing and
/// stage lose heat to ambient.
struct ThermalParams {
  double R_winding_housing = 1.5;  // K/W
  double C_winding = 30.0;         // J/K
  double R_housing_ambient = 3.0;  // K/W
  double C_housing = 165.0;        // J/K
  double R_stage_ambient = 15.0;   // K/W
  double C_stage = 15.0;           // J/K
  double temp_ambient = 25.0;      // °C, can be changed while running
};

struct EncoderParams {
  int bits = 14;             // 10..18
  int direction = 1;         // +1 or −1: counts grow or fall with the rotor angle
  double offset = 0.0;       // rad, mounting angle of the magnet: raw angle at rotor angle 0
  double inl_1 = 0.0;        // rad, integral non-linearity, once per turn
  double inl_1_phase = 0.0;  // rad
  double inl_2 = 0.0;        // rad, twice per turn
  double inl_2_phase = 0.0;  // rad
  double noise = 0.0;        // rad rms
  double latency = 2e-6;     // s
};

/// Two phase-current amplifiers (a, b); the drive computes c = −a − b.
struct CurrentSensorParams {
  double range = 33.0;    // A, full scale to either side
  int bits = 12;          // ADC over −range..range
  double offset_a = 0.0;  // A
  double offset_b = 0.0;  // A
  double gain_a = 1.0;    // 1
  double gain_b = 1.0;    // 1
  double noise = 0.05;    // A rms
};

struct SlowSensorParams {
  double v_lsb = 0.01;    // V, bus voltage ADC
  double v_noise = 0.02;  // V rms
  double temp_lsb = 0.5;  // K, temperature ADC
  // The motor's thermistor is on the board: it reads the winding's temperature plus this share of
  // (board − housing).
  double board_share = 0.0;
};

/// Rates of the firmware, and the rule that converts gain bytes to physical gains
/// (docs/internals/model.md §11). A bandwidth is proportional to its gain byte; the values here are
/// for the reference bytes `ref_…`.
struct ControlParams {
  int motion_divider = 4;             // current-loop periods per speed/position-loop period
  bool has_current_loop = true;       // false (MS series): the loops set the voltage vector
  double current_bandwidth = 6283.0;  // rad/s at current Kp, Ki = ref_current_byte
  double emf_share = 1.0;             // 0..1 of the back-EMF that the current loop feeds forward
  double speed_bandwidth = 200.0;     // rad/s at speed Kp = ref_speed_kp_byte and inertia J_nominal
  double speed_integral_rate = 20.0;  // 1/s, Ki/Kp at the reference speed bytes
  double angle_kp_per_byte = 0.5;     // 1/s per LSB of angle Kp
  double angle_ki_per_byte = 0.05;    // 1/s² per LSB of angle Ki, within 0.02 rad of the target
  double estimator_bandwidth = 1500.0;  // rad/s, natural frequency of the speed observer
  double report_bandwidth = 300.0;      // rad/s, 1/window of the reported speed
  double report_delay = 0.0;            // s, from the end of a window to its report, < window
  double ref_current_byte = 50.0;
  double ref_speed_kp_byte = 50.0;
  double ref_speed_ki_byte = 40.0;
  double J_nominal = 933e-7;  // kg·m² at the rotor, for which the speed gain was designed
};

/// All parameters of one drive; load, supply and ambient may change while it runs.
struct DriveParams {
  MotorParams motor;
  InverterParams inverter;
  MechanicsParams mechanics;
  LoadParams load;
  SupplyParams supply;
  ThermalParams thermal;
  EncoderParams encoder;
  CurrentSensorParams current_sensor;
  SlowSensorParams slow_sensor;
  LogicParams logic;
  BrakeParams brake;
  ControlParams control;
};

}  // namespace lk::model
