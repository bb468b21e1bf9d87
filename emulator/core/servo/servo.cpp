#include "emulator/core/servo/servo.hpp"

#include <algorithm>

#include "emulator/core/seed.hpp"
#include "emulator/core/units.hpp"
#include "protocol/rounding.hpp"

namespace lk::emulator {

using protocol::Echo;
using protocol::Opcode;
using protocol::Reply;

namespace {

/// Bits of errorState that `legacy` shows: under-voltage and motor over-temperature. The other
/// errors turn the bridge off as well.
constexpr model::ErrorBits kLegacyErrors =
    model::bit(model::Error::kUnderVoltage) | model::bit(model::Error::kMotorTemperature);

// At rest on zero, a drive answers 0x92 with a copy of the query, which hosts take for an echo. A
// drawn boot angle avoids that.
constexpr double kBootAngleMargin_deg = 5;

/// Draws an angle within the turn that the encoder field spans, away from the zero of each rotor
/// turn.
double drawn_angle_deg(const ServoConfig& config, std::uint64_t bus_seed) {
  const double turns = encoder_turns(config.profile, config.quirks) *
                       uniform(stream_seed(bus_seed, config.id, SeedStream::kBootAngle));
  const auto turn = static_cast<double>(protocol::rounded_down(turns));
  return 360 * turn + kBootAngleMargin_deg + (turns - turn) * (360 - 2 * kBootAngleMargin_deg);
}

}  // namespace

namespace {

double mounted_theta_m(const ServoConfig& config) {
  return config.joint->output_of(config.joint->start_rad) *
         config.profile.drive.mechanics.gear_ratio;
}

}  // namespace

double start_theta_m(const ServoConfig& config, double angle_deg) {
  ShaftAngles angles(config.profile, config.quirks);
  angles.set_offset(config.boot_offset.value_or(config.rom.encoder_offset));
  return angles.theta_m_at(angle_deg);
}

model::DriveInit make_drive(const ServoConfig& config, std::uint64_t bus_seed) {
  const protocol::Dialect& dialect = config.quirks.dialect;
  const double start_deg =
      config.boot_angle_deg ? *config.boot_angle_deg : drawn_angle_deg(config, bus_seed);
  return {.params = config.profile.drive,
          .settings =
              control_settings(config.rom, protocol::wire_format(dialect, config.profile.series)),
          .seed = stream_seed(bus_seed, config.id, SeedStream::kNoise),
          .theta_m = config.joint ? mounted_theta_m(config) : start_theta_m(config, start_deg),
          .temp = config.boot_temperature_C};
}

Servo::Servo(const ServoConfig& config, const model::Telemetry& boot)
    : config_(config),
      format_(protocol::wire_format(config.quirks.dialect, config.profile.series)),
      rom_(config.rom),
      wear_(config.wear),
      angles_(config.profile, config.quirks) {
  start(boot);
}

void Servo::start(const model::Telemetry& telemetry) {
  ++starts_;
  ram_ = rom_;
  apply_startup_faults();
  angles_.set_offset(ram_.encoder_offset);
  start_multi_turn(telemetry, config_.quirks.boot_multi_turn);
  apply_turn_faults(telemetry);
  run_state_ = RunState::kRunning;
  tripped_ = false;
  motion_ = {};
  brake_powered_ = false;
  hung_ = OffHangs::kNo;
  bus_address_ = drive_address(ram_, config_);
  pending_parameters_.reset();
  saved_.reset();
  address_change_pending_ = false;
  calibration_.reset();
  loses_next_ = false;
  arm_command_loss(LostAfter::kBoot);
}

void Servo::start_multi_turn(const model::Telemetry& telemetry, BootMultiTurn from) {
  const std::int64_t position = angles_.position(telemetry);
  if (from == BootMultiTurn::kZero) {
    angles_.set_multi_turn(position, 0);
  } else {
    angles_.forget_turns(position);
  }
}

void Servo::power_cycle(const Lane& lane) {
  start(lane.telemetry());
  configure(lane);
  lane.set_brake_coil(false);
  lane.restart();
}

std::variant<protocol::Query, protocol::Reject> Servo::understand(
    const protocol::Frame& frame) const {
  auto decoded = protocol::decode_query(frame, format_);
  const auto* query = std::get_if<protocol::Query>(&decoded);
  if (query != nullptr && query->id == protocol::kMultiDrive) {
    return protocol::for_drive(address(), *query, format_);
  }
  return decoded;
}

Reply Servo::handle(const protocol::Query& query, const Lane& lane) {
  const model::Telemetry before = lane.telemetry();
  const bool was_mute = is_mute();
  turn_off_after_trip(before);
  lane.feed_input();
  ++stats_.queries;
  const Context context{query, before, lane};
  const Reply reply =
      std::visit([&](const auto& command) { return on(command, context); }, query.command);
  shown_faults_.hangs_after_off |= was_mute && faults_.hangs_after_off;
  if (!std::holds_alternative<protocol::NoReply>(reply)) ++stats_.replies;
  return reply;
}

/// A tripped protection has turned the bridge off and cancelled the command. Only 0x9B and then
/// 0x88 make the drive run again.
void Servo::turn_off_after_trip(const model::Telemetry& telemetry) {
  if (telemetry.errors != 0) {
    run_state_ = RunState::kOff;
    tripped_ = true;
    motion_ = {};
  }
  if ((telemetry.errors & model::bit(model::Error::kLostInput)) != 0) {
    arm_command_loss(LostAfter::kLostInput);
  }
}

// --- run state ---

Reply Servo::on(const protocol::Off&, const Context& context) {
  run_state_ = RunState::kOff;
  motion_ = {};
  const Quirks& quirks = config_.quirks;
  start_multi_turn(context.before, quirks.off_multi_turn == OffMultiTurn::kAsBoot
                                       ? quirks.boot_multi_turn
                                       : BootMultiTurn::kSingleTurn);
  context.lane.command(model::Off{});
  arm_command_loss(LostAfter::kOff);
  hung_ = std::max({hung_, quirks.off_hangs, faults_.off_hangs});
  return echo(context);
}

Reply Servo::on(const protocol::Stop&, const Context& context) {
  if (run_state_ == RunState::kRunning) {
    run_state_ = RunState::kStopped;
    if (config_.quirks.stop_holds) {
      const auto here = angles_.at(angles_.position(context.before));
      context.lane.command(model::Position{angles_.theta(here), 0});
    } else {
      context.lane.command(model::Idle{});
    }
  }
  return echo(context);
}

Reply Servo::on(const protocol::Run&, const Context& context) {
  const bool resumes = run_state_ == RunState::kStopped && config_.quirks.run_resumes;
  if (run_state_ != RunState::kRunning && context.before.errors == 0) {
    if (!resumes) {
      motion_ = {};
    }
    run_state_ = RunState::kRunning;
    tripped_ = false;
    context.lane.command(motion_.setpoint);
  }
  return echo(context);
}

/// The reply shows the coil after the command, as the reply to 0x9B shows the remaining errors.
Reply Servo::on(const protocol::Brake& command, const Context& context) {
  switch (command.action) {
    case protocol::kBrakeEngage:
    case protocol::kBrakeRelease:
      brake_powered_ = command.action == protocol::kBrakeRelease;
      context.lane.set_brake_coil(brake_powered_);
      break;
    case protocol::kBrakeRead:
      break;
    default:
      ++stats_.invalid_targets;
  }
  return protocol::BrakeState{brake_powered_};
}

// --- states ---

Reply Servo::on(const protocol::ReadState1&, const Context& context) const {
  return state_1(protocol::ReadState1::kOpcode, context.before);
}

Reply Servo::on(const protocol::ClearErrors&, const Context& context) {
  context.lane.clear_errors();
  arm_command_loss(LostAfter::kClear);
  const model::Telemetry after = context.lane.telemetry();
  if (!clear_reply_before()) return state_1(protocol::ClearErrors::kOpcode, after);
  shown_faults_.clear_reply_before |= context.before.errors != after.errors;
  return state_1(protocol::ClearErrors::kOpcode, context.before);
}

Reply Servo::on(const protocol::ReadState2&, const Context& context) const {
  return state_2(protocol::ReadState2::kOpcode, context.before);
}

Reply Servo::on(const protocol::ReadState3&, const Context& context) const {
  const model::Telemetry& before = context.before;
  return protocol::State3{before.temp_motor, before.i_a, before.i_b, before.i_c};
}

Reply Servo::state_1(Opcode command, const model::Telemetry& telemetry) const {
  const model::ErrorBits shown =
      format_.dialect.all_error_bits ? model::ErrorBits{0xFF} : kLegacyErrors;
  return protocol::State1{.command = reply_opcode(command),
                          .temperature_C = telemetry.temp_motor,
                          .voltage_V = telemetry.v_bus,
                          .errors = static_cast<std::uint8_t>(telemetry.errors & shown),
                          .bus_current_A = telemetry.i_bus,
                          .bridge_on = run_state_ != RunState::kOff};
}

Reply Servo::state_2(Opcode command, const model::Telemetry& telemetry) const {
  return protocol::State2{
      .command = reply_opcode(command),
      .temperature_C = telemetry.temp_motor,
      .iq_A = telemetry.i_q,
      .speed_dps = dps_from_rad_s(telemetry.omega),
      .encoder_counts = angles_.encoder(angles_.position(telemetry), ram_.encoder_offset),
      .power_permille = protocol::quantize<std::int16_t>(telemetry.power, 1e-3)};
}

/// Returns DATA[0] of the reply: that of the query, or the misprint in the manual.
Opcode Servo::reply_opcode(Opcode command) const {
  if (!config_.quirks.manual_reply_bytes || format_.dialect.framing == protocol::Framing::kSerial) {
    return command;
  }
  const Opcode printed = protocol::find_command(static_cast<std::uint8_t>(command))->printed;
  return printed != Opcode{} ? printed : command;
}

}  // namespace lk::emulator
