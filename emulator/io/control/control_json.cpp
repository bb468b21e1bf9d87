#include "emulator/io/control/control_json.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "emulator/config/config_serial.hpp"
#include "emulator/config/profile_fields.hpp"
#include "emulator/config/register_fields.hpp"
#include "emulator/core/faults/fault_table.hpp"
#include "emulator/core/frame_text.hpp"
#include "emulator/core/generation.hpp"
#include "emulator/core/scenario/scenario_text.hpp"
#include "emulator/core/servo/shaft_angles.hpp"
#include "emulator/core/servo/signals.hpp"
#include "emulator/core/units.hpp"
#include "emulator/files/output_file.hpp"
#include "emulator/files/profile_files.hpp"

namespace lk::emulator {
namespace {

namespace fields = profile_fields;

std::string as_key(std::string_view words) {
  std::string key(words);
  std::ranges::replace(key, ' ', '_');
  return key;
}

/// Words for FaultEvidence::State, in its order.
constexpr const char* kStateWords[] = {"armed", "active", "paused", "over", "cleared"};

template <typename Section>
void put(Json& json, const Field<Section>& field, const Section& section) {
  std::visit(
      [&](auto member) {
        const auto value = section.*member;
        if constexpr (std::is_same_v<decltype(value), const double>) {
          json[field.key] = value / field.unit;
        } else {
          json[field.key] = value;
        }
      },
      field.member);
}

/// Returns the registers under the keys of [settings].
Json registers_json(const Registers& registers, const ServoConfig& servo) {
  Json json = Json::object();
  for (const auto& field : fields::kRegisters) put(json, field, registers);
  if (servo.profile.series == Series::kMs) {
    put(json, fields::max_power(), registers);
  } else {
    put(json, fields::max_torque_current(servo.quirks.dialect.iq_command_limit_lsb), registers);
  }
  Json& gains = json["gains"] = Json::object();
  if (servo.quirks.dialect.parameter_commands) {
    for (const auto& field : fields::kWideGains) put(gains, field, registers.gains);
  } else {
    for (const auto& field : fields::kGains) put(gains, field, registers.gains);
  }
  Json& protections = json["protection"] = Json::object();
  for (std::size_t kind = 0; kind < registers.protections.size(); ++kind) {
    const auto& keys = fields::kProtections[kind];
    Json& one = protections[keys.name] = Json::object();
    for (const auto& field : keys.fields) put(one, field, registers.protections[kind]);
  }
  return json;
}

Json load_json(const model::LoadParams& load) {
  Json json = Json::object();
  for (const auto& field : fields::kLoad) put(json, field, load);
  return json;
}

Json surroundings_json(const DriveConditions& now) {
  return {{"power", now.power ? "on" : "off"},
          {"supply_V", now.supply_V},
          {"ambient_C", now.ambient_C},
          {"load", load_json(now.load)}};
}

/// Returns the set point in the units of commands; null if the loops have none.
Json setpoint_json(const model::Setpoint& setpoint, const Servo& servo) {
  if (const auto* torque = std::get_if<model::Torque>(&setpoint)) return {{"iq_A", torque->i_q}};
  if (const auto* speed = std::get_if<model::Speed>(&setpoint)) {
    return {{"speed_dps", dps_from_rad_s(speed->omega)}};
  }
  if (const auto* position = std::get_if<model::Position>(&setpoint)) {
    return {{"angle_deg", servo.angles.multi_turn_deg(position->theta)}};
  }
  if (const auto* open = std::get_if<model::OpenLoop>(&setpoint)) return {{"power", open->power}};
  return nullptr;
}

/// Returns ID, bus type and bit rates of a drive: in use, saved, and pending until its next start.
Json place_json(const Servo& servo, const Line& line) {
  const BusConfig& bus = line.config();
  const bool has_921600 = !bus.serial || bus.serial->has_921600;
  const auto json = [has_921600](const DriveAddress& address) {
    constexpr const char* kBuses[] = {"none", "rs485", "can"};
    return Json{{"id", address.id},
                {"bus_type", kBuses[static_cast<std::size_t>(address.bus)]},
                {"rs485_rate", serial_rate_of(address.serial_rate, has_921600)},
                {"can_rate", can_rate_of(address.can_rate)}};
  };
  Json place = json(servo.bus_address);
  place["heard"] = servo.on_its_bus() && servo.at_its_rate();
  place["shared_with"] = sharing_drives(bus, servo.config.id, [&line](const ServoConfig& one) {
    return line.bus().bus_address(one.id);
  });
  place["saved"] = json(drive_address(servo.rom, servo.config));
  place["pending"] = servo.pending_parameters.any()
                         ? json(drive_address(pending_rom(servo), servo.config))
                         : Json(nullptr);
  return place;
}

/// Lists the drives whose address differs from the configuration, now or after the next start.
Json moved_json(const Line& line) {
  Json moved = Json::array();
  for (const ServoConfig& config : line.config().servos) {
    const Servo& servo = line.bus().servo(config.id);
    const DriveAddress wired = drive_address(Registers{}, config);
    const bool at_home = servo.bus_address == wired && drive_address(servo.rom, config) == wired &&
                         !servo.pending_parameters.any();
    if (!at_home) moved.push_back({{"id", config.id}, {"place", place_json(servo, line)}});
  }
  return moved;
}

/// Returns a drive's construction and start values, which do not change during a run.
Json built_json(const ServoConfig& servo) {
  const model::DriveParams& drive = servo.profile.drive;
  const double turns = encoder_turns(servo.profile, servo.quirks);
  const ShaftAngles angles(servo.profile, servo.quirks);
  return {{"gear_ratio", drive.mechanics.gear_ratio},
          {"encoder_counts", angles.max_wire_count() + 1},
          {"encoder_turns", turns},
          {"supply_V", drive.supply.v_source},
          {"ambient_C", drive.thermal.temp_ambient},
          {"load", load_json(drive.load)}};
}

Json optional_seconds(const std::optional<SimTime>& time) {
  return time ? Json(in_seconds(*time)) : Json(nullptr);
}

Json parameter_value(const FaultParam& param, const FaultValue& value) {
  if (param.choices.empty()) return value.number();
  return param.choices[static_cast<std::size_t>(value.choice())];
}

/// The hosts' side of a CAN bus; null on RS-485.
Json host_json(const Line& line) {
  if (line.config().serial) return nullptr;
  const HostSide& host = line.bus().state().host;
  const std::size_t room = line.room();
  return {{"tx_queue", line.config().host_queue.frames},
          {"tx_room", room == SIZE_MAX ? Json(nullptr) : Json(room)},
          {"transmit_errors", host.errors.transmit_errors},
          {"receive_errors", host.errors.receive_errors},
          {"acknowledged", !host.unacknowledged},
          {"bus_off", host.cut == HostCut::kOff}};
}

}  // namespace

Json bus_json(const Line& line) {
  const BusStats stats = line.bus().stats();
  Json ids = Json::array();
  for (const ServoConfig& servo : line.config().servos) ids.push_back(servo.id);
  Json dropped = Json::object();
  for (std::size_t cause = 0; cause < protocol::kRejects; ++cause) {
    dropped[as_key(to_string(static_cast<protocol::Reject>(cause)))] = stats.dropped[cause];
  }
  Json counters = {{"frames", stats.frames},
                   {"queries", stats.queries},
                   {"replies", stats.replies},
                   {"replies_lost", stats.replies_lost},
                   {"replies_collided", stats.replies_collided},
                   {"replies_overrun", stats.replies_overrun},
                   {"frames_waiting", stats.frames_waiting},
                   {"replies_waiting", stats.replies_waiting},
                   {"extra_frames", stats.extra_frames},
                   {"error_frames", stats.error_frames},
                   {"dropped", dropped},
                   {"refused_motion", stats.refused_motion},
                   {"invalid_targets", stats.invalid_targets},
                   {"rom_writes", stats.rom_writes},
                   {"queue_peak", stats.queue_peak},
                   {"unacknowledged", stats.unacknowledged},
                   {"replayed", stats.replayed},
                   {"stale", stats.stale},
                   {"wire_busy_s", in_seconds(stats.wire_busy)},
                   {"waiting_for_time", line.backlog()},
                   {"lost_while_time_stood", line.backlog_lost()},
                   {"advice_left_out", line.adviser().left_out()},
                   {"rom_gate",
                    {{"waiting", line.gate().waiting()},
                     {"failed_writes", line.gate().failed_writes()},
                     {"lost_replies", line.gate().lost_replies()}}}};
  if (const Port* port = line.port()) {
    const PortStats sent = port->stats();
    counters["interface"] = {{"sent", sent.sent},
                             {"pending", sent.pending},
                             {"lost_link_down", sent.lost_link_down},
                             {"lost_queue_full", sent.lost_queue_full},
                             {"kernel_drops", sent.kernel_drops},
                             {"link_losses", sent.link_losses}};
  }
  return {{"bus", line.name()},
          {"ids", ids},
          {"up", line.is_up()},
          {"time_s", in_seconds(line.bus().time())},
          {"bitrate", line.config().bitrate},
          {"host", host_json(line)},
          {"moved", moved_json(line)},
          {"planned",
           line.bus().state().agenda.directives() + line.bus().state().conditions.directives()},
          {"counters", counters}};
}

Json drive_json(const Line& line, int id) {
  const DriveView drive = line.bus().view(id);
  const ServoConfig& servo = drive.servo.config;
  Json errors = Json::array();
  for (int n = 0; n < model::kErrorKinds; ++n) {
    const auto error = static_cast<model::Error>(n);
    if ((drive.telemetry.errors & model::bit(error)) != 0) errors.push_back(error_word(error));
  }
  Json values = Json::object();
  for (const Signal& signal : signals()) values[std::string(signal.name)] = signal.read(drive);
  const ServoStats& stats = drive.servo.stats;
  return {{"bus", line.name()},
          {"id", id},
          {"place", place_json(drive.servo, line)},
          {"motor", servo.profile.name},
          {"model", servo.profile.model},
          {"series", protocol::name_of(servo.profile.series)},
          {"generation", generation_name(servo.generation)},
          {"state", state_word(drive.servo.run_state_at(drive.telemetry))},
          {"alive", drive.telemetry.alive},
          {"errors", errors},
          {"signals", values},
          {"setpoint", setpoint_json(line.bus().state().setpoint(id), drive.servo)},
          {"surroundings", surroundings_json(line.bus().state().drive_conditions(id))},
          {"built", built_json(servo)},
          {"registers",
           {{"ram", registers_json(drive.servo.ram, servo)},
            {"rom", registers_json(drive.servo.rom, servo)}}},
          {"counters",
           {{"queries", stats.queries},
            {"replies", stats.replies},
            {"sent", line.sent(id)},
            {"unknown_commands", stats.unknown_commands},
            {"wrong_mode", stats.wrong_mode},
            {"refused_motion", stats.refused_motion},
            {"invalid_targets", stats.invalid_targets},
            {"rom_writes", stats.rom_writes}}}};
}

Json advice_json(const Line& line, const Advice& advice) {
  return {{"kind", advice_row(advice.found.kind).word},
          {"drive", advice.id},
          {"bus", line.name()},
          {"count", advice.count},
          {"first_s", in_seconds(advice.first)},
          {"frame", frame_text(advice.frame)},
          {"what", what_text(advice, Language::kEnglish)},
          {"todo", todo_text(advice, Language::kEnglish)},
          {"what_zh", what_text(advice, Language::kChinese)},
          {"todo_zh", todo_text(advice, Language::kChinese)}};
}

Json fault_json(const Line& line, const FaultReport& report) {
  const Fault& fault = report.fault;
  const FaultEvidence& evidence = report.evidence;
  const FaultRow& row = *fault.row;
  Json parameters = Json::object();
  for (std::size_t n = 0; n < row.params.size() && !row.params[n].word.empty(); ++n) {
    parameters[std::string(row.params[n].word)] = parameter_value(row.params[n], fault.values[n]);
  }
  if (row.per_frame) parameters["probability"] = fault.probability;
  if (fault.duration) parameters["for_s"] = in_seconds(*fault.duration);
  if (fault.every) parameters["every_s"] = in_seconds(*fault.every);
  if (fault.times > 0) parameters["times"] = fault.times;
  return {{"bus", line.name()},
          {"name", fault.name},
          {"kind", row.word},
          {"ids", fault.ids},
          {"state", kStateWords[static_cast<std::size_t>(evidence.state)]},
          {"armed_at_s", in_seconds(evidence.armed_at)},
          {"began_at_s", optional_seconds(evidence.began_at)},
          {"first_effect_at_s", optional_seconds(evidence.first_effect_at)},
          {"effects", evidence.effects},
          {"first_on", evidence.first_on},
          {"parameters", parameters}};
}

Json fault_kinds_json() {
  Json kinds = Json::array();
  for (const FaultRow& row : fault_table()) {
    Json params = Json::array();
    for (const FaultParam& param : row.params) {
      if (param.word.empty()) break;
      Json one = {{"name", param.word}, {"required", param.required}};
      if (!param.choices.empty()) {
        one["choices"] = std::vector(param.choices.begin(), param.choices.end());
      } else {
        one["min"] = param.min;
        one["max"] = param.max;
        one["whole"] = param.whole;
      }
      if (!param.required) one["default"] = parameter_value(param, param.fallback);
      params.push_back(std::move(one));
    }
    kinds.push_back({{"kind", row.word},
                     {"group", to_string(row.group)},
                     {"about", row.about.en},
                     {"about_zh", row.about.zh},
                     {"of_bus", row.of_bus},
                     {"rs485", row.serial},
                     {"per_frame", row.per_frame},
                     {"momentary", row.momentary()},
                     {"needs_one", row.needs_one},
                     {"parameters", params}});
  }
  return kinds;
}

namespace {

/// Returns nullopt if a file cannot be read, so that the caller tries again later.
std::optional<Json> read_scenarios() {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry :
       std::filesystem::directory_iterator(config_directory() / "scenarios", error)) {
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  }
  if (error) return std::nullopt;
  std::ranges::sort(files);
  Json all = Json::array();
  for (const auto& file : files) {
    std::string about;
    try {
      about = toml::parse(read_regular_file(file, kLongestText), file.string())["about"].value_or(
          std::string());
    } catch (const toml::parse_error&) {  // reported when the scenario is started
    } catch (const std::invalid_argument&) {
      return std::nullopt;
    }
    all.push_back({{"name", file.stem().string()}, {"file", file.string()}, {"about", about}});
  }
  return all;
}

}  // namespace

/// Reads the files once: reading blocks the loop of the drives, and shipped files do not change.
Json scenarios_json() {
  static std::optional<Json> all;
  if (!all) all = read_scenarios();
  return all.value_or(Json::array());
}

Json signals_json(const World& world) {
  Json all = Json::array();
  for (const Signal* signal : signals_with(world.lines().front()->config().body_signals.get())) {
    all.push_back({{"name", signal->name}, {"about", signal->about}});
  }
  return all;
}

}  // namespace lk::emulator
