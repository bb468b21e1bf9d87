#include "emulator/config/profile.hpp"

#include <algorithm>
#include <cctype>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/config/config_checks.hpp"
#include "emulator/config/config_reader.hpp"
#include "emulator/config/profile_fields.hpp"
#include "emulator/config/register_fields.hpp"
#include "emulator/core/generation.hpp"
#include "protocol/rounding.hpp"

namespace lk::emulator {
namespace {

namespace fields = profile_fields;

/// In the order of EncoderSpan.
const std::vector<std::string> kEncoderSpans{"rotor_turn", "output_turn"};

void check_direction(TableReader& reader, const model::EncoderParams& encoder) {
  if (encoder.direction == 0) reader.table("encoder")->fail("direction", "must be 1 or -1");
}

void check_friction(TableReader& reader, const model::MechanicsParams& mechanics) {
  if (mechanics.tau_static < mechanics.tau_coulomb) {
    reader.fail_together({"mechanics.tau_static_mNm", "mechanics.tau_coulomb_mNm"},
                         "must not be below tau_coulomb_mNm");
  }
}

/// Reads Max Torque Current, or Max Power of an MS drive.
void read_limit(TableReader& reader, Presence presence, const RegisterRules& rules,
                Registers& registers) {
  const bool ms = rules.series == Series::kMs;
  if (ms && reader.has("max_torque_current_lsb")) {
    reader.fail("max_torque_current_lsb", "not for MS drives; use max_power_permille");
  }
  if (!ms && reader.has("max_power_permille")) {
    reader.fail("max_power_permille", "for MS drives only; use max_torque_current_lsb");
  }
  const Field<Registers> limit[] = {ms ? fields::max_power()
                                       : fields::max_torque_current(rules.iq_limit_lsb)};
  read_fields<Registers>(reader, limit, presence, registers);
}

void read_gains(TableReader& reader, Presence presence, const RegisterRules& rules,
                model::GainBytes& gains) {
  if (rules.wide_gains) {
    read_section(reader, "gains", fields::kWideGains, presence, gains);
    return;
  }
  if (reader.has("gains")) {
    const auto table = reader.table("gains");
    for (const char* key : {"angle_kd", "speed_kd", "current_kd"}) {
      if (table->has(key)) table->fail(key, "only drives with parameter_commands have it");
    }
  }
  read_section(reader, "gains", fields::kGains, presence, gains);
}

/// Rejects an under-voltage threshold up to the voltage at which the controller starts.
void check_reset(const TableReader& reader, const Profile& profile) {
  constexpr auto kUnderVoltage = static_cast<std::size_t>(model::Error::kUnderVoltage);
  const model::LogicParams& logic = profile.drive.logic;
  if (logic.v_reset + logic.v_reset_hysteresis <
      profile.factory.protections[kUnderVoltage].threshold) {
    return;
  }
  reader.fail_together(
      {"factory.protection.under_voltage.threshold_V", "logic.reset_V", "logic.reset_hysteresis_V"},
      "must be above logic.reset_V + logic.reset_hysteresis_V");
}

void check_factory(const TableReader& reader, const Profile& profile) {
  const std::string control = control_problem(profile.series, profile.drive.control);
  if (!control.empty()) reader.fail_together({"control.has_current_loop", "series"}, control);
  const std::string offset = offset_problem(profile.factory.encoder_offset, profile.drive.encoder);
  if (!offset.empty()) reader.fail_together({"factory.encoder_offset", "encoder.bits"}, offset);
  const std::string voltages = voltage_problem(profile.factory);
  if (!voltages.empty()) {
    reader.fail_together(
        {"factory.protection.over_voltage.threshold_V",
         "factory.protection.under_voltage.threshold_V", "factory.protection.over_voltage.enabled",
         "factory.protection.under_voltage.enabled"},
        voltages);
  }
}

void check_rating(const TableReader& reader, const Rating& rating) {
  if (rating.voltage_min_V <= rating.voltage_max_V) return;
  reader.fail_together({"rating.voltage_min_V", "rating.voltage_max_V"},
                       "must not be above voltage_max_V");
}

/// Reads a version with two decimals and stores hundredths.
void read_version(TableReader& product, const char* key, std::uint16_t& version) {
  if (const auto number = product.number(key, 0, 655.35)) {
    version = static_cast<std::uint16_t>(protocol::rounded(*number * 100));
  }
}

/// Reads [product]: the data that the drive reports to 0x12 on RS-485.
void read_product(TableReader& reader, Product& product) {
  auto table = reader.table("product");
  if (!table) return;
  constexpr std::size_t kMaxLetters = 20;
  for (const auto& [key, name] :
       {std::pair("driver", &product.driver), {"motor", &product.motor}}) {
    const auto text = table->text(key);
    if (!text) continue;
    if (text->size() > kMaxLetters) table->fail(key, "is longer than 20 bytes");
    *name = *text;
  }
  read_version(*table, "hardware_version", product.hardware_version);
  read_version(*table, "motor_version", product.motor_version);
  read_version(*table, "firmware_version", product.firmware_version);
  if (const auto text = table->text("chip_id")) {
    const bool hexadecimal =
        std::ranges::all_of(*text, [](unsigned char c) { return std::isxdigit(c) != 0; });
    if (text->size() != 2 * product.chip_id.size() || !hexadecimal) {
      table->fail("chip_id", "is not 24 hexadecimal digits");
    }
    for (std::size_t n = 0; n < product.chip_id.size(); ++n) {
      product.chip_id[n] =
          static_cast<std::uint8_t>(std::stoul(text->substr(2 * n, 2), nullptr, 16));
    }
  }
  table->finish();
}

// --- files that extend others

/// Keys that a motor file does not inherit: trade names, and facts known only of the base motor.
constexpr const char* kNotInherited[] = {"extends", "aliases", "rating", "product",
                                         "seen_generation"};

/// Returns the motor file that `document` extends; nullopt if none.
std::optional<MotorFile> base_of(const toml::table& document, const std::string& file,
                                 const std::vector<std::string>& files,
                                 const FindMotorFile& find_base) {
  TableReader reader(document, file, "");
  const auto motor = reader.text("extends");
  if (!motor) return std::nullopt;
  if (!find_base) reader.fail("extends", "not possible here: no other motor files are available");
  MotorFile base;
  try {
    base = find_base(motor_of(file, *motor));
  } catch (const UnknownMotor& problem) {
    reader.fail("extends", problem.what());
  }
  for (const std::string& other : files) {
    if (plain_path(other) == plain_path(base.file)) {
      reader.fail("extends", other + " extends itself");
    }
  }
  if (files.size() >= kMaxMotorFiles) {
    reader.fail("extends", "more than " + std::to_string(kMaxMotorFiles) +
                               " motor files, each extending the next, or a loop of them");
  }
  return base;
}

/// Moves the values that `table` lacks from `base`; a moved value keeps its source line.
void inherit(toml::table& table, toml::table& base) {
  for (auto&& [key, inherited] : base) {
    toml::node* const own = table.get(key);
    if (own == nullptr) {
      inherited.visit([&, &name = key](auto& value) { table.insert(name, std::move(value)); });
    } else if (own->is_table() && inherited.is_table()) {
      inherit(*own->as_table(), *inherited.as_table());
    }
  }
}

/// Rejects a base motor of another series: the series differ too much.
void check_series(const toml::table& document, const std::string& file, const toml::table& base) {
  const auto own = document["series"].value<std::string>();
  const auto inherited = base["series"].value<std::string>();
  if (!own || !inherited || *own == *inherited) return;
  TableReader(document, file, "")
      .fail("series", "differs from the motor that it extends: " + *inherited);
}

/// A motor file with all inherited values; each value keeps its own file and line.
struct MotorDocument {
  toml::table table;
  std::vector<std::string> files;  // its own, then the one that it extends, …
  bool later_print = false;        // one of them was named by such a label
};

/// Applies what the label says by which a motor file was found. Returns LabelFacts::later_print.
bool apply_label(const std::string& label, toml::table& table) {
  const LabelFacts facts = label_facts(label);
  if (facts.encoder_span) {
    table.insert_or_assign("encoder_span",
                           kEncoderSpans[static_cast<std::size_t>(*facts.encoder_span)]);
  }
  return facts.later_print;
}

MotorDocument read_motor_document(const MotorFile& motor, const FindMotorFile& find_base) {
  std::vector<toml::table> tables;  // tables are moved: a copy would lose the source lines
  tables.push_back(parse_toml(motor.text, motor.file));
  std::vector<std::string> files{motor.file};
  bool later_print = apply_label(motor.label, tables.back());
  while (const auto base = base_of(tables.back(), files.back(), files, find_base)) {
    tables.push_back(parse_toml(base->text, base->file));
    files.push_back(base->file);
    later_print |= apply_label(base->label, tables.back());
  }
  for (std::size_t n = tables.size() - 1; n > 0; --n) {
    check_series(tables[n - 1], files[n - 1], tables[n]);
    for (const char* own : kNotInherited) tables[n].erase(own);
    inherit(tables[n - 1], tables[n]);
  }
  return {std::move(tables.front()), std::move(files), later_print};
}

/// Returns true if the table states the cogging itself.
bool states_cogging(TableReader& reader) {
  const auto mechanics = reader.table("mechanics");
  return mechanics && mechanics->has("tau_cogging_mNm");
}

/// Reads the mechanics. A file that states `tau_cogging_mNm` states all of the cogging.
void read_mechanics(TableReader& reader, Presence presence, model::MechanicsParams& mechanics) {
  if (states_cogging(reader)) mechanics.tau_cogging_3 = mechanics.tau_pole_cogging = 0;
  read_section(reader, "mechanics", fields::kMechanics, presence, mechanics);
}

/// Sets the texture by the rule of [stator], if there is one; values that the file states win.
void read_stator(TableReader& reader, Presence presence, model::DriveParams& params) {
  Stator stator;
  if (!reader.has("stator")) {
    if (presence == Presence::kRequired && !states_cogging(reader)) reader.note_missing("stator");
    return;
  }
  read_section(reader, "stator", fields::kStator, Presence::kRequired, stator);
  set_texture(stator, params);
  read_section(reader, "motor", fields::kMotor, Presence::kOptional, params.motor);
  read_mechanics(reader, Presence::kOptional, params.mechanics);
  read_section(reader, "current_sensor", fields::kCurrentSensor, Presence::kOptional,
               params.current_sensor);
}

}  // namespace

void read_drive_params(TableReader& reader, Presence presence, model::DriveParams& params) {
  read_section(reader, "motor", fields::kMotor, presence, params.motor);
  read_section(reader, "inverter", fields::kInverter, presence, params.inverter);
  read_mechanics(reader, presence, params.mechanics);
  read_section(reader, "iron", fields::kIron, Presence::kOptional, params.mechanics);
  read_section(reader, "supply", fields::kSupply, presence, params.supply);
  read_section(reader, "logic", fields::kLogic, presence, params.logic);
  // A brake needs all keys, or none.
  const Presence fitted = reader.has("brake") ? presence : Presence::kOptional;
  read_section(reader, "brake", fields::kBrake, fitted, params.brake);
  read_section(reader, "thermal", fields::kThermal, presence, params.thermal);
  read_section(reader, "encoder", fields::kEncoder, presence, params.encoder);
  read_section(reader, "current_sensor", fields::kCurrentSensor, presence, params.current_sensor);
  read_section(reader, "slow_sensor", fields::kSlowSensor, presence, params.slow_sensor);
  read_section(reader, "thermistor", fields::kThermistor, Presence::kOptional, params.slow_sensor);
  read_section(reader, "control", fields::kControl, presence, params.control);
  read_stator(reader, presence, params);
  if (reader.has("encoder")) check_direction(reader, params.encoder);
  if (reader.has("mechanics")) check_friction(reader, params.mechanics);
}

void read_load(TableReader& reader, model::LoadParams& load) {
  read_section(reader, "load", fields::kLoad, Presence::kOptional, load);
  if (load.theta_min > load.theta_max) {
    reader.table("load")->fail("theta_min_deg", "must not be above theta_max_deg");
  }
}

void read_registers(TableReader& reader, Presence presence, const RegisterRules& rules,
                    Registers& registers) {
  read_fields<Registers>(reader, fields::kRegisters, presence, registers);
  read_limit(reader, presence, rules, registers);
  read_gains(reader, presence, rules, registers.gains);
  read_protections(reader, presence, registers);
}

void read_protections(TableReader& reader, Presence presence, Registers& registers) {
  auto protections = reader.table("protection");
  if (!protections) {
    if (presence == Presence::kRequired) reader.note_missing("protection");
    return;
  }
  for (std::size_t kind = 0; kind < registers.protections.size(); ++kind) {
    const auto& keys = fields::kProtections[kind];
    read_section(*protections, keys.name, keys.fields, presence, registers.protections[kind]);
  }
  protections->finish();
}

Profile parse_profile(const MotorFile& motor, const FindMotorFile& find_base) {
  MotorDocument document = read_motor_document(motor, find_base);
  TableReader reader(document.table, motor.file, "");
  Profile profile;
  profile.name = motor.name;
  profile.files = std::move(document.files);
  profile.aliases = reader.texts("aliases");
  reader.text("extends");
  reader.table("identified");  // used by `lk-emu identify --expect`
  profile.model = reader.required("model", reader.text("model"));
  profile.series = static_cast<Series>(
      reader.required("series", reader.choice("series", {std::begin(protocol::kSeriesNames),
                                                         std::end(protocol::kSeriesNames)})));
  profile.encoder_span = static_cast<EncoderSpan>(
      reader.required("encoder_span", reader.choice("encoder_span", kEncoderSpans)));
  profile.later_print = document.later_print;
  if (const auto seen = reader.choice("seen_generation", generation_names())) {
    profile.seen_generation = static_cast<Generation>(*seen);
  }
  if (const auto loop = reader.choice("current_loop", {"fast", "slow"})) {
    profile.current_loop = static_cast<CurrentLoopKind>(*loop);
  }
  profile.states_cogging = states_cogging(reader);
  read_section(reader, "rating", fields::kRating, Presence::kOptional, profile.rating);
  read_product(reader, profile.product);
  read_drive_params(reader, Presence::kRequired, profile.drive);
  if (auto factory = reader.table("factory")) {
    read_registers(*factory, Presence::kRequired, {.series = profile.series}, profile.factory);
    factory->finish();
  } else {
    reader.note_missing("factory");
  }
  reader.finish();
  if (const auto problem = model_problem(profile.drive)) {
    reader.fail_together(problem->keys, problem->reason);
  }
  check_reset(reader, profile);
  check_factory(reader, profile);
  check_rating(reader, profile.rating);
  return profile;
}

Profile parse_profile(const std::string& text, const std::string& file, const std::string& name) {
  return parse_profile({name, file, text}, {});
}

}  // namespace lk::emulator
