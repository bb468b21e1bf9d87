#include "emulator/core/servo/servo.hpp"

#include <utility>

#include "emulator/core/seed.hpp"
#include "emulator/core/servo/servo_commands.hpp"
#include "emulator/core/servo/specimen.hpp"
#include "emulator/core/units.hpp"
#include "protocol/rounding.hpp"

namespace lk::emulator {

namespace {

// Distance of drawn boot angles from zero. At rest on zero, a drive answers 0x92 with the same
// bytes as the query, and hosts take the answer for an echo.
constexpr double kBootAngleMargin_deg = 5;

/// Draws an angle within the turn that the encoder field spans, away from the zero of each rotor
/// turn.
double drawn_angle_deg(const ServoConfig& config, std::uint64_t bus_seed) {
  const double turns = encoder_turns(config.profile, config.quirks) *
                       uniform(stream_seed(bus_seed, config.id, SeedStream::kBootAngle));
  const auto turn = static_cast<double>(protocol::rounded_down(turns));
  return 360 * turn + kBootAngleMargin_deg + (turns - turn) * (360 - 2 * kBootAngleMargin_deg);
}

double mounted_theta_m(const ServoConfig& config) {
  return config.joint->output_of(config.joint->start_rad) *
         config.profile.drive.mechanics.gear_ratio;
}

/// Starts the controller: RAM from ROM, no command.
void start_firmware(Servo& servo, const model::Telemetry& telemetry) {
  ++servo.starts;
  servo.ram = servo.rom;
  apply_startup_faults(servo);
  servo.angles.set_offset(servo.ram.encoder_offset);
  start_multi_turn(servo, telemetry, servo.config.quirks.boot_multi_turn);
  apply_turn_faults(servo, telemetry);
  servo.run_state = RunState::kRunning;
  servo.tripped = false;
  servo.motion = {};
  servo.brake_powered = false;
  servo.hung = OffHangs::kNo;
  servo.bus_address = drive_address(servo.ram, servo.config);
  servo.pending_parameters.reset();
  servo.saved_parameters.reset();
  servo.address_change_pending = false;
  servo.calibration.reset();
  servo.loses_next = false;
  arm_command_loss(servo, LostAfter::kBoot);
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
  const double theta_m = config.joint ? mounted_theta_m(config) : start_theta_m(config, start_deg);
  model::DriveParams params = config.profile.drive;
  if (config.specimen == Specimen::kDrawn) {
    draw_specimen(stream_seed(bus_seed, config.id, SeedStream::kSpecimen), theta_m, params);
  }
  return {.params = params,
          .settings =
              control_settings(config.rom, protocol::wire_format(dialect, config.profile.series)),
          .seed = stream_seed(bus_seed, config.id, SeedStream::kNoise),
          .theta_m = theta_m,
          .temp = config.boot_temperature_C};
}

Servo::Servo(const ServoConfig& configuration, const model::Telemetry& boot)
    : config(configuration),
      format(protocol::wire_format(config.quirks.dialect, config.profile.series)),
      rom(config.rom),
      wear(config.wear),
      angles(config.profile, config.quirks) {
  start_firmware(*this, boot);
}

void power_cycle(Servo& servo, const Lane& lane) {
  start_firmware(servo, lane.telemetry());
  configure_loops(servo, lane);
  lane.set_brake_coil(false);
  lane.restart();
}

std::variant<Query, protocol::Reject> understand(const Servo& servo, const protocol::Frame& frame) {
  auto decoded = protocol::decode_query(frame, servo.format);
  const auto* query = std::get_if<Query>(&decoded);
  if (query != nullptr && query->id == protocol::kMultiDrive) {
    return protocol::for_drive(servo.address(), *query, servo.format);
  }
  return decoded;
}

Reply handle(Servo& servo, const Query& query, const Lane& lane) {
  const model::Telemetry before = lane.telemetry();
  const bool was_mute = servo.is_mute();
  turn_off_after_trip(servo, before);
  lane.feed_input();
  ++servo.stats.queries;
  const Context context{query, before, lane};
  const Reply reply = std::visit(
      [&](const auto& command) { return execute(servo, command, context); }, query.command);
  servo.effective_faults.hangs_after_off |= was_mute && servo.faults.hangs_after_off;
  if (!std::holds_alternative<protocol::NoReply>(reply)) ++servo.stats.replies;
  return reply;
}

protocol::Frame encode(const Servo& servo, const Reply& reply) {
  return protocol::encode_reply(servo.address(), reply, servo.format);
}

bool take_restart(Servo& servo) { return std::exchange(servo.restart_pending, false); }

FirmwareFaults take_effective_faults(Servo& servo) {
  return std::exchange(servo.effective_faults, {});
}

}  // namespace lk::emulator
