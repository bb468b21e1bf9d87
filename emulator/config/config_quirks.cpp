#include "emulator/config/config_quirks.hpp"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <numbers>
#include <optional>
#include <type_traits>
#include <utility>

#include "emulator/core/generation.hpp"
#include "emulator/core/servo/shaft_angles.hpp"
#include "emulator/core/text.hpp"
#include "protocol/field.hpp"

namespace lk::emulator {
namespace {

using protocol::Dialect;
using Choices = std::vector<std::string>;
constexpr const char* kSeen = "seen";

/// A switch of [quirks]: its key, and the values that a file may give (`choices`; empty: any byte).
/// An integer member stores the value; a bool or enumeration stores the index of the choice.
class Switch {
 public:
  enum class Wire : std::uint8_t { kAny, kSerial };

  template <typename Section, typename Value>
  Switch(const char* name, Value Section::*member, Choices all = {"false", "true"},
         Wire on = Wire::kAny)
      : key(name), choices(std::move(all)), wire(on) {
    store_ = [member](Quirks& quirks, std::size_t n, std::size_t number) {
      constexpr bool kIsNumber = std::is_integral_v<Value> && !std::is_same_v<Value, bool>;
      const auto value = static_cast<Value>(kIsNumber ? number : n);
      if constexpr (std::is_same_v<Section, Quirks>) {
        quirks.*member = value;
      } else {
        quirks.dialect.*member = value;
      }
    };
  }
  template <typename Value>
  Switch(const char* name, std::optional<Value> Quirks::*member, Choices all)
      : key(name), choices(std::move(all)) {
    store_ = [member](Quirks& quirks, std::size_t n, std::size_t /*number*/) {
      quirks.*member = static_cast<Value>(n);
    };
  }
  Switch(const char* name, std::optional<int> Quirks::*member, Choices all)
      : key(name), choices(std::move(all)) {
    store_ = [member](Quirks& quirks, std::size_t /*n*/, std::size_t number) {
      quirks.*member = static_cast<int>(number);
    };
  }
  bool is_flag() const { return !choices.empty() && choices.front() == "false"; }
  bool is_word() const { return !is_number() && !is_flag(); }
  bool is_number() const { return choices.empty() || choices.front().front() <= '9'; }
  std::size_t count() const { return choices.empty() ? 256 : choices.size(); }
  /// Returns the choice `n` as a number. Pre: is_number().
  std::size_t number(std::size_t n) const {
    return choices.empty() ? n : std::stoul(choices[n], nullptr, 0);
  }
  void set(Quirks& quirks, std::size_t n) const { store_(quirks, n, is_number() ? number(n) : n); }
  bool is_on_wire_of(const Quirks& quirks) const {
    return wire == Wire::kAny || quirks.dialect.framing == protocol::Framing::kSerial;
  }

  const char* key;
  Choices choices;
  Wire wire = Wire::kAny;

 private:
  std::function<void(Quirks&, std::size_t, std::size_t)> store_;
};

const Choices kFlag{"false", "true"};
const Choices kBits{"16", "32"};
const Choices kScales{"manual", "series"};
constexpr auto kSerial = Switch::Wire::kSerial;

/// Switches in the order of listings. The words of a switch are in the order of its enumeration.
// clang-format off
const std::vector<Switch> kSwitches = {
    {"state_1", &Dialect::state_1, {"decivolt", "centivolt", "centivolt_and_bus_current"}},
    {"single_turn_bits", &Dialect::wide_single_turn, kBits},
    {"single_turn_target_bits", &Dialect::wide_single_turn_target, kBits},
    {"zero_reply_bits", &Dialect::wide_zero_reply, kBits},
    {"pid_commands", &Dialect::pid_commands},
    {"offset_command", &Dialect::offset_command},
    {"open_loop_command", &Dialect::open_loop_command},
    {"speed_iq_limit", &Dialect::speed_iq_limit},
    {"brake_command", &Dialect::brake_command},
    {"parameter_commands", &Dialect::parameter_commands},
    {"multi_drive_more", &Dialect::multi_drive_more},
    {"all_error_bits", &Dialect::all_error_bits},
    {"max_torque_commands", &Dialect::max_torque_commands},
    {"setting_commands", &Dialect::setting_commands},
    {"restart_command", &Dialect::restart_command},
    {"calibrate_command", &Dialect::calibrate_command},
    {"parameter_ranges", &Dialect::parameter_ranges},
    {"zero_stops", &Dialect::zero_stops},
    {"clear_angle", &Dialect::clear_angle, {"ignored", "implemented", "sets_angle", "zero"}},
    {"iq_command_limit_lsb", &Dialect::iq_command_limit_lsb, {"2000", "2048"}},
    {"iq_scale", &Dialect::iq_scale, kScales},
    {"phase_current_scale", &Dialect::phase_current_scale, kScales},
    {"reply_id_base", &Dialect::reply_id_base, {"0x140", "0x180"}},
    {"state_on_byte", &Dialect::state_on_byte, {}},
    {"manual_reply_bytes", &Quirks::manual_reply_bytes},
    {"offset_write_takes_effect", &Quirks::offset_write_takes_effect},
    {"run_resumes", &Quirks::run_resumes},
    {"off_needs_run", &Quirks::off_needs_run},
    {"stop_holds", &Quirks::stop_holds},
    {"boot_wrap", &Quirks::boot_wrap, {"half_circle", "half_turn"}},
    {"boot_multi_turn", &Quirks::boot_multi_turn, {"single_turn", "zero"}},
    {"off_multi_turn", &Quirks::off_multi_turn, {"as_boot", "single_turn"}},
    {"clear_reply", &Quirks::clear_reply, {"after", "before"}},
    {"id_change", &Quirks::id_change, {"restart", "save", "write"}},
    {"id_change_reply", &Quirks::id_change_reply, {"old", "new"}},
    {"setting_read", &Quirks::setting_read, {"pending", "active"}},
    {"calibrate_busy", &Quirks::calibrate_busy, {"silent", "answers"}},
    {"off_hangs", &Quirks::off_hangs, {"no", "drive", "bus"}},
    {"encoder_span", &Quirks::encoder_span, {"rotor_turn", "output_turn"}},
    {"encoder_bits", &Quirks::encoder_bits, {"14", "16"}},
    {"current_loop", &Quirks::current_loop, {"fast", "slow"}},
    {"clear_turns_command", &Dialect::clear_turns_command, kFlag, kSerial},
    {"zero_ram_command", &Dialect::zero_ram_command, kFlag, kSerial},
    {"typed_encoder", &Dialect::typed_encoder, kFlag, kSerial},
    {"zero_answered", &Dialect::zero_answered, kFlag, kSerial},
    {"tool_commands", &Dialect::tool_commands, kFlag, kSerial},
    {"restore_command", &Dialect::restore_command, kFlag, kSerial},
    {"zero_ram_len", &Dialect::zero_ram_len, {"0", "7"}, kSerial},
    {"open_loop_limit_permille", &Dialect::open_loop_limit_permille, {"850", "1000"}, kSerial},
    {"product_info_bytes", &Dialect::product_info_bytes, {"0", "42", "58"}, kSerial},
    {"wrong_len", &Dialect::lax_length, {"silent", "lax"}, kSerial},
};
// clang-format on

std::optional<std::size_t> read_choice(TableReader& reader, const Switch& one) {
  if (one.is_word()) return reader.choice(one.key, one.choices);
  if (one.is_flag()) {
    const auto flag = reader.boolean(one.key);
    return flag ? std::optional<std::size_t>(*flag) : std::nullopt;
  }
  if (one.choices.empty()) {
    const auto byte = reader.integer(one.key, 0, 255);
    return byte ? std::optional(static_cast<std::size_t>(*byte)) : std::nullopt;
  }
  // "must be 0, 42 or 58"
  const std::string reason = "must be " + comma_list({one.choices.begin(), one.choices.end() - 1}) +
                             " or " + one.choices.back();
  if (reader.has(one.key) && !reader.is_integer(one.key)) reader.fail(one.key, reason);
  const auto number = reader.integer(one.key, INT64_MIN, INT64_MAX);
  if (!number) return std::nullopt;
  for (std::size_t n = 0; n < one.count(); ++n) {
    if (std::cmp_equal(one.number(n), *number)) return n;
  }
  reader.fail(one.key, reason);
}

/// Prints a switch in the form of a configuration file.
std::string printed(const Switch& one, const Quirks& quirks) {
  std::string value = "the motor's";
  for (std::size_t n = 0; n < one.count(); ++n) {
    Quirks set = quirks;
    one.set(set, n);
    if (!(set == quirks)) continue;
    value = one.choices.empty() ? std::to_string(n) : one.choices[n];
    if (one.is_word()) value = '"' + value + '"';
  }
  return std::string(one.key) + " = " + value;
}

/// Unless the motor file states it: slow for MF and MH drives in `legacy` (one log), else fast.
CurrentLoopKind usual_current_loop(const ServoConfig& servo) {
  if (servo.profile.current_loop) return *servo.profile.current_loop;
  const bool direct = servo.profile.series == Series::kMf || servo.profile.series == Series::kMh;
  return direct && servo.generation == Generation::kLegacy ? CurrentLoopKind::kSlow
                                                           : CurrentLoopKind::kFast;
}

void read_quirks(TableReader& reader, ServoConfig& servo) {
  Quirks& quirks = servo.quirks;
  for (const Switch& one : kSwitches) {
    if (!one.is_on_wire_of(quirks)) continue;
    if (const auto n = read_choice(reader, one)) one.set(quirks, *n);
  }
  if (quirks.dialect.state_on_byte == protocol::kBridgeOff) {
    reader.fail("state_on_byte", "must not be 0x10, which means off");
  }
  if (quirks.encoder_span == servo.profile.encoder_span) quirks.encoder_span.reset();
  const bool has_14_bits = servo.profile.series == Series::kMf ||
                           servo.profile.series == Series::kMh ||
                           wire_bits(servo.profile.drive.encoder) == 14;
  if (reader.has("encoder_bits") && quirks.encoder_bits == 14 && !has_14_bits) {
    reader.fail("encoder_bits",
                servo.profile.name + " has 16 only: " + protocol::name_of(servo.profile.series) +
                    " drives show the upper 16 of 18 bits; MF and MH have 14 or 16");
  }
  if (quirks.current_loop == usual_current_loop(servo)) quirks.current_loop.reset();
  if (quirks.current_loop && !servo.profile.drive.control.has_current_loop) {
    reader.fail("current_loop", "MS drives have none");
  }
  if (quirks.dialect.framing == protocol::Framing::kSerial &&
      quirks.dialect.reply_id_base != protocol::kSingleDriveId) {
    reader.fail("reply_id_base", "belongs to CAN");
  }
  // Presets set open_loop_command for every series, though only MS drives use it. A file that sets
  // it for another series is wrong.
  if (quirks.dialect.open_loop_command && servo.profile.series != Series::kMs &&
      reader.has("open_loop_command")) {
    reader.fail("open_loop_command", "MS drives only");
  }
}

/// Sets the loops of a direct drive of the oldest firmware to those of a log
/// (docs/internals/model.md §11). Its current follows steps of 50 to 150 LSB with 30 to 42 1/s. Its
/// speed overshoots by 66 % and rings at 40 Hz.
void set_slow_current_loop(model::DriveParams& drive) {
  constexpr double kCurrentLoop = 35;  // 1/s, at the reference bytes; the log's bytes are unknown
  constexpr double kDamping = 70;      // 1/s, of the speed, by the back-EMF; from the overshoot
  constexpr double kSpeedLoop = 1790;  // rad/s: (2π·40 Hz)²/kCurrentLoop
  constexpr double kCurrentNoise = 0.125;  // A: iq deviates by 11 to 15 LSB at 573 dps
  constexpr double kEstimator = 8000;      // rad/s, assumed: hardly delays the back-EMF
  constexpr double kSpeedIntegral = 2;     // 1/s, assumed: stable with ten rotors, as the angle's
  constexpr double kAnglePerByte = 0.25;   // 1/s, assumed: real drives showed 0.12 to 1.5
  const model::MotorParams& motor = drive.motor;
  const double p_psi = motor.pole_pairs * motor.psi_f;
  const double without = 1.5 * p_psi * p_psi / (motor.R_s * drive.mechanics.J);  // 1/s
  model::ControlParams& control = drive.control;
  // The log's current grows at once: its board compensates the dead time.
  drive.inverter.t_dead = 0;
  drive.current_sensor.noise = kCurrentNoise;
  control.current_bandwidth = kCurrentLoop;
  control.emf_share = std::max(0.0, 1 - kDamping / without);
  control.estimator_bandwidth = kEstimator;
  control.speed_bandwidth = kSpeedLoop;
  control.speed_integral_rate = kSpeedIntegral;
  control.angle_kp_per_byte = kAnglePerByte;
}

// --- command line

/// Inserts an option into `table` as a TOML value. Words need no quotes; case is ignored.
void insert_value(toml::table& table, const std::string& key, const std::string& given) {
  const std::string value = small_letters(given);
  const bool hexadecimal = value.starts_with("0x");
  const auto number =
      number_of(value.substr(hexadecimal ? 2 : 0), hexadecimal ? 16 : 10, INT32_MAX);
  const auto found = std::ranges::find(kSwitches, key, &Switch::key);
  if (found != kSwitches.end() && found->is_word()) {
    table.insert(key, value);
  } else if (value == "true" || value == "false") {
    table.insert(key, value == "true");
  } else if (number) {
    table.insert(key, static_cast<std::int64_t>(*number));
  } else {
    table.insert(key, value);
  }
}

void apply_quirks(const std::map<std::string, std::string>& asked, ServoConfig& servo) {
  if (asked.empty()) return;
  toml::table table;
  for (const auto& [key, value] : asked) insert_value(table, key, value);
  TableReader reader(table, "--quirk", "");
  read_quirks(reader, servo);
  const std::vector<std::string>& known = reader.read_keys();
  for (const auto& [key, value] : asked) {
    if (std::ranges::find(known, key) != known.end() || !closest_match(key, known).empty())
      continue;
    reader.fail(key, "unknown; known: " + comma_list(known));
  }
  reader.finish();
}

/// Sets the bits of the encoder. Its errors and the windows of the reported speed become those of
/// shipped motors with these bits.
void set_encoder_bits(int bits, model::DriveParams& drive) {
  constexpr double kDeg = std::numbers::pi / 180;
  const bool wide = bits > 14;
  drive.encoder.bits = bits;
  drive.encoder.inl_1 = (wide ? 0.05 : 0.2) * kDeg;
  drive.encoder.inl_2 = (wide ? 0.025 : 0.1) * kDeg;
  drive.encoder.noise = (wide ? 0.001 : 0.003) * kDeg;
  drive.control.report_bandwidth = wide ? 1000 : 750;
  drive.control.report_delay = wide ? 0 : 0.5e-3;
}

/// Later prints and later firmware of MF drives show 16 of 18 bits.
void set_usual_encoder(ServoConfig& servo) {
  const bool later_firmware =
      servo.profile.series == Series::kMf && servo.generation != Generation::kLegacy;
  model::DriveParams& drive = servo.profile.drive;
  if ((servo.profile.later_print || later_firmware) && wire_bits(drive.encoder) == 14) {
    set_encoder_bits(18, drive);
  }
}

Generation resolve_generation(const std::string& word, const std::string& drive,
                              const Profile& profile) {
  try {
    return chosen_generation(word, profile);
  } catch (const NeverSeen& problem) {
    throw std::invalid_argument("--generation: " + drive + " (" + profile.name +
                                "): " + problem.what());
  } catch (const std::invalid_argument& problem) {
    throw std::invalid_argument(sanitized_line(std::string("--generation: ") + problem.what()));
  }
}

/// Normalises spellings: "v2.35" and "235" are equal.
std::string letters_and_digits(std::string word) {
  std::erase_if(word, [](char c) { return c == '.' || c == '-' || c == '_' || c == ' '; });
  return word.starts_with('v') ? word.substr(1) : word;
}

/// Suggests a name only for another spelling of it: V237 is not a misspelt V235.
std::string suggestion(const std::string& word) {
  for (const std::string& name : generation_words()) {
    if (letters_and_digits(name) == letters_and_digits(word)) return ", did you mean " + name + "?";
  }
  return "";
}

Generation read_choice(const TableReader& reader, const std::string& word, const Profile& profile) {
  try {
    return chosen_generation(word, profile);
  } catch (const std::invalid_argument& problem) {
    reader.fail("generation", problem.what());
  }
}

}  // namespace

void apply_encoder_bits(ServoConfig& servo) {
  model::DriveParams& drive = servo.profile.drive;
  std::optional<int>& asked = servo.quirks.encoder_bits;
  if (asked == wire_bits(drive.encoder)) asked.reset();
  if (asked) set_encoder_bits(*asked == 14 ? 14 : 18, drive);
}

std::vector<std::string> differing_switches(Generation generation, const Quirks& quirks) {
  const Quirks preset = quirks_of(generation, quirks.dialect.framing);
  std::vector<std::string> differing;
  for (const Switch& one : kSwitches) {
    std::string line = printed(one, quirks);
    if (one.is_on_wire_of(quirks) && line != printed(one, preset)) {
      differing.push_back(std::move(line));
    }
  }
  return differing;
}

std::vector<std::string> generation_words() {
  std::vector<std::string> words = generation_names();
  words.emplace_back(kSeen);
  return words;
}

Generation chosen_generation(const std::string& word, const Profile& profile) {
  const std::string wanted = small_letters(word);
  if (const auto named = generation_of(wanted)) return *named;
  if (wanted != kSeen) {
    throw std::invalid_argument("\"" + word + "\" is not one of " + comma_list(generation_words()) +
                                suggestion(wanted));
  }
  if (profile.seen_generation) return *profile.seen_generation;
  throw NeverSeen(
      "the generation of real drives of this motor is unknown; lk-emu motors lists the motors that "
      "have one");
}

void read_generation(TableReader& reader, const FirmwareRequest& asked, const std::string& drive,
                     ServoConfig& servo) {
  const auto in_file = reader.text("generation");
  if (asked.generation) {
    servo.generation = resolve_generation(*asked.generation, drive, servo.profile);
    servo.generation_given = true;
  } else if (in_file) {
    servo.generation = read_choice(reader, *in_file, servo.profile);
    servo.generation_given = true;
  }
  servo.quirks = quirks_of(servo.generation, servo.quirks.dialect.framing);
  if (auto quirks = reader.table("quirks")) {
    read_quirks(*quirks, servo);
    quirks->finish();
  }
  apply_quirks(asked.quirks, servo);
  set_usual_encoder(servo);
  if (servo.quirks.current_loop.value_or(usual_current_loop(servo)) == CurrentLoopKind::kSlow) {
    set_slow_current_loop(servo.profile.drive);
  }
}

}  // namespace lk::emulator
