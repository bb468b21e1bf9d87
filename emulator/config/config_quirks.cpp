#include "emulator/config/config_quirks.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <iterator>
#include <optional>
#include <string_view>
#include <system_error>

#include "emulator/core/generation.hpp"
#include "emulator/core/text.hpp"
#include "protocol/field.hpp"

namespace lk::emulator {
namespace {

using protocol::Dialect;

// One row per line.
// clang-format off
const Field<Quirks> kQuirkSwitches[] = {
    {"manual_reply_bytes", &Quirks::manual_reply_bytes},
    {"offset_write_takes_effect", &Quirks::offset_write_takes_effect},
    {"run_resumes", &Quirks::run_resumes},
    {"off_needs_run", &Quirks::off_needs_run},
    {"stop_holds", &Quirks::stop_holds},
};
const Field<Dialect> kDialectSwitches[] = {
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
};
const Field<Dialect> kSerialSwitches[] = {
    {"clear_turns_command", &Dialect::clear_turns_command},
    {"zero_ram_command", &Dialect::zero_ram_command},
    {"typed_encoder", &Dialect::typed_encoder},
    {"zero_answered", &Dialect::zero_answered},
    {"tool_commands", &Dialect::tool_commands},
    {"restore_command", &Dialect::restore_command},
};
// clang-format on
using Choices = std::vector<std::string>;
const Choices kState1{"decivolt", "centivolt", "centivolt_and_bus_current"};
const Choices kClearAngle{"ignored", "implemented", "sets_angle", "zero"};
const Choices kScales{"manual", "series"};
const Choices kBootWraps{"half_circle", "half_turn"};
const Choices kBootMultiTurns{"single_turn", "zero"};
const Choices kOffMultiTurns{"as_boot", "single_turn"};
const Choices kClearReplies{"after", "before"};
const Choices kIdChanges{"restart", "save", "write"};
const Choices kIdChangeReplies{"old", "new"};
const Choices kSettingReads{"pending", "active"};
const Choices kCalibrateBusy{"silent", "answers"};
const Choices kOffHangs{"no", "drive", "bus"};
const Choices kWrongLengths{"silent", "lax"};
const Choices kSpans{"rotor_turn", "output_turn"};
/// Switches with one of these words as value.
constexpr std::string_view kWordKeys[] = {
    "state_1",         "clear_angle",     "iq_scale",       "phase_current_scale",
    "boot_wrap",       "boot_multi_turn", "off_multi_turn", "clear_reply",
    "off_hangs",       "encoder_span",    "wrong_len",      "id_change",
    "id_change_reply", "setting_read",    "calibrate_busy"};
constexpr const char* kSeen = "seen";

/// Reads an enumeration; `words` are in the order of its values.
template <typename Enum>
void read_word(TableReader& reader, const char* key, const Choices& words, Enum& value) {
  if (const auto word = reader.choice(key, words)) value = static_cast<Enum>(*word);
}

/// Reads a number with two allowed values; `words` names them in messages.
std::optional<std::int64_t> read_either(TableReader& reader, const char* key, std::int64_t one,
                                        std::int64_t other, const char* words) {
  const std::string reason = std::string("must be ") + words;
  if (reader.has(key) && !reader.is_integer(key)) reader.fail(key, reason);
  const auto value = reader.integer(key, INT64_MIN, INT64_MAX);
  if (value && *value != one && *value != other) reader.fail(key, reason);
  return value;
}

/// Reads switches that only RS-485 drives have.
void read_serial_dialect(TableReader& reader, Dialect& dialect) {
  read_fields<Dialect>(reader, kSerialSwitches, Presence::kOptional, dialect);
  if (const auto len = read_either(reader, "zero_ram_len", 0, 7, "0 or 7")) {
    dialect.zero_ram_len = static_cast<std::uint8_t>(*len);
  }
  if (const auto limit =
          read_either(reader, "open_loop_limit_permille", 850, 1000, "850 or 1000")) {
    dialect.open_loop_limit_permille = static_cast<std::int16_t>(*limit);
  }
  if (const auto bytes = reader.integer("product_info_bytes", 0, 58)) {
    if (*bytes != 0 && *bytes != 42 && *bytes != 58) {
      reader.fail("product_info_bytes", "must be 0, 42 or 58");
    }
    dialect.product_info_bytes = static_cast<std::uint8_t>(*bytes);
  }
  if (const auto word = reader.choice("wrong_len", kWrongLengths)) dialect.lax_length = *word == 1;
  if (dialect.reply_id_base != protocol::kSingleDriveId) {
    reader.fail("reply_id_base", "belongs to CAN");
  }
}

void read_dialect(TableReader& reader, Dialect& dialect) {
  read_fields<Dialect>(reader, kDialectSwitches, Presence::kOptional, dialect);
  read_word(reader, "state_1", kState1, dialect.state_1);
  read_word(reader, "clear_angle", kClearAngle, dialect.clear_angle);
  read_word(reader, "iq_scale", kScales, dialect.iq_scale);
  read_word(reader, "phase_current_scale", kScales, dialect.phase_current_scale);
  if (const auto bits = read_either(reader, "single_turn_bits", 16, 32, "16 or 32")) {
    dialect.wide_single_turn = *bits == 32;
  }
  if (const auto bits = read_either(reader, "single_turn_target_bits", 16, 32, "16 or 32")) {
    dialect.wide_single_turn_target = *bits == 32;
  }
  if (const auto bits = read_either(reader, "zero_reply_bits", 16, 32, "16 or 32")) {
    dialect.wide_zero_reply = *bits == 32;
  }
  if (const auto limit = read_either(reader, "iq_command_limit_lsb", 2000, 2048, "2000 or 2048")) {
    dialect.iq_command_limit_lsb = static_cast<std::int16_t>(*limit);
  }
  if (const auto base = read_either(reader, "reply_id_base", 0x140, 0x180, "0x140 or 0x180")) {
    dialect.reply_id_base = static_cast<std::uint32_t>(*base);
  }
  if (const auto byte = reader.integer("state_on_byte", 0, 255)) {
    if (*byte == protocol::kBridgeOff)
      reader.fail("state_on_byte", "must not be 0x10, which means off");
    dialect.state_on_byte = static_cast<std::uint8_t>(*byte);
  }
  if (dialect.framing == protocol::Framing::kSerial) read_serial_dialect(reader, dialect);
}

/// Prints all switches in the form of a configuration file, in a fixed order.
class Printer {
 public:
  explicit Printer(const Quirks& quirks) {
    const Dialect& dialect = quirks.dialect;
    word("state_1", kState1, dialect.state_1);
    add("single_turn_bits", dialect.wide_single_turn ? "32" : "16");
    add("single_turn_target_bits", dialect.wide_single_turn_target ? "32" : "16");
    add("zero_reply_bits", dialect.wide_zero_reply ? "32" : "16");
    for (const auto& field : kDialectSwitches) flag(field, dialect);
    word("clear_angle", kClearAngle, dialect.clear_angle);
    add("iq_command_limit_lsb", std::to_string(dialect.iq_command_limit_lsb));
    word("iq_scale", kScales, dialect.iq_scale);
    word("phase_current_scale", kScales, dialect.phase_current_scale);
    add("reply_id_base", dialect.reply_id_base == protocol::kSingleDriveId ? "0x140" : "0x180");
    add("state_on_byte", std::to_string(dialect.state_on_byte));
    for (const auto& field : kQuirkSwitches) flag(field, quirks);
    word("boot_wrap", kBootWraps, quirks.boot_wrap);
    word("boot_multi_turn", kBootMultiTurns, quirks.boot_multi_turn);
    word("off_multi_turn", kOffMultiTurns, quirks.off_multi_turn);
    word("clear_reply", kClearReplies, quirks.clear_reply);
    word("id_change", kIdChanges, quirks.id_change);
    word("id_change_reply", kIdChangeReplies, quirks.id_change_reply);
    word("setting_read", kSettingReads, quirks.setting_read);
    word("calibrate_busy", kCalibrateBusy, quirks.calibrate_busy);
    word("off_hangs", kOffHangs, quirks.off_hangs);
    const auto& span = quirks.encoder_span;
    add("encoder_span", span ? quoted(kSpans[static_cast<std::size_t>(*span)]) : "the motor's");
    if (dialect.framing == protocol::Framing::kCan) return;
    for (const auto& field : kSerialSwitches) flag(field, dialect);
    add("zero_ram_len", std::to_string(dialect.zero_ram_len));
    add("open_loop_limit_permille", std::to_string(dialect.open_loop_limit_permille));
    add("product_info_bytes", std::to_string(dialect.product_info_bytes));
    add("wrong_len", quoted(kWrongLengths[dialect.lax_length ? 1 : 0]));
  }
  const std::vector<std::string>& lines() const { return lines_; }

 private:
  static std::string quoted(const std::string& word) { return '"' + word + '"'; }
  void add(const char* key, const std::string& value) {
    lines_.push_back(std::string(key) + " = " + value);
  }
  template <typename Enum>
  void word(const char* key, const Choices& words, Enum value) {
    add(key, quoted(words[static_cast<std::size_t>(value)]));
  }
  template <typename Section>
  void flag(const Field<Section>& field, const Section& section) {
    add(field.key, section.*std::get<bool Section::*>(field.member) ? "true" : "false");
  }

  std::vector<std::string> lines_;
};

void read_quirks(TableReader& reader, ServoConfig& servo) {
  read_fields<Quirks>(reader, kQuirkSwitches, Presence::kOptional, servo.quirks);
  read_dialect(reader, servo.quirks.dialect);
  read_word(reader, "boot_wrap", kBootWraps, servo.quirks.boot_wrap);
  read_word(reader, "boot_multi_turn", kBootMultiTurns, servo.quirks.boot_multi_turn);
  read_word(reader, "off_multi_turn", kOffMultiTurns, servo.quirks.off_multi_turn);
  read_word(reader, "clear_reply", kClearReplies, servo.quirks.clear_reply);
  read_word(reader, "id_change", kIdChanges, servo.quirks.id_change);
  read_word(reader, "id_change_reply", kIdChangeReplies, servo.quirks.id_change_reply);
  read_word(reader, "setting_read", kSettingReads, servo.quirks.setting_read);
  read_word(reader, "calibrate_busy", kCalibrateBusy, servo.quirks.calibrate_busy);
  read_word(reader, "off_hangs", kOffHangs, servo.quirks.off_hangs);
  EncoderSpan span = servo.quirks.encoder_span.value_or(servo.profile.encoder_span);
  read_word(reader, "encoder_span", kSpans, span);
  servo.quirks.encoder_span.reset();
  if (span != servo.profile.encoder_span) servo.quirks.encoder_span = span;
  // Presets set it for every series, though only MS uses it. An explicit request for another series
  // is a mistake.
  if (servo.quirks.dialect.open_loop_command && servo.profile.series != Series::kMs &&
      reader.has("open_loop_command")) {
    reader.fail("open_loop_command", "MS drives only");
  }
}

// --- command line

/// Converts an option to TOML; words need no quotes, and case is ignored.
void insert_value(toml::table& table, const std::string& key, const std::string& given) {
  const std::string value = small_letters(given);
  const bool hexadecimal = value.starts_with("0x");
  const char* const last = value.data() + value.size();
  std::int64_t number = 0;
  const auto [end, error] =
      std::from_chars(value.data() + (hexadecimal ? 2 : 0), last, number, hexadecimal ? 16 : 10);
  if (std::ranges::find(kWordKeys, key) != std::end(kWordKeys)) {
    table.insert(key, value);
  } else if (value == "true" || value == "false") {
    table.insert(key, value == "true");
  } else if (error == std::errc() && end == last) {
    table.insert(key, number);
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

/// Suggests only other spellings: V237 is not a misspelt V235.
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

std::vector<std::string> differing_switches(Generation generation, const Quirks& quirks) {
  const Printer preset(quirks_of(generation, quirks.dialect.framing));
  const Printer drive(quirks);
  std::vector<std::string> differing;
  for (std::size_t k = 0; k < drive.lines().size(); ++k) {
    if (drive.lines()[k] != preset.lines()[k]) differing.push_back(drive.lines()[k]);
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
}

}  // namespace lk::emulator
