#include "emulator/monitor/record/recording.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <limits>
#include <map>
#include <type_traits>

#include "emulator/config/bus_name.hpp"
#include "emulator/config/profile.hpp"
#include "emulator/config/rom_file.hpp"
#include "emulator/core/start_error.hpp"
#include "emulator/files/json_table.hpp"
#include "emulator/files/output_file.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

/// Returns a number; throws JsonError unless it is whole and in range. The JSON library would
/// convert any number silently.
template <class Number>
Number whole(const Json& json) {
  constexpr auto kMax = static_cast<std::uint64_t>(std::numeric_limits<Number>::max());
  constexpr auto kLeast = static_cast<std::int64_t>(std::numeric_limits<Number>::min());
  const bool fits = json.is_number_unsigned()
                        ? json.get<std::uint64_t>() <= kMax
                        : json.is_number_integer() && json.get<std::int64_t>() >= kLeast;
  if (!fits) throw JsonError("", "is not a whole number in range: " + json.dump());
  return json.get<Number>();
}

RomWear read_wear(const Json& json) {
  RomWear wear{};  // earlier versions had fewer parameters
  for (std::size_t p = 0; p < std::min(wear.size(), json.size()); ++p) {
    wear[p] = whole<std::uint32_t>(json.at(p));
  }
  return wear;
}

// --- recording.json

template <class Value>
void put(Json& json, const char* key, const std::optional<Value>& value) {
  if (value) json[key] = *value;
}

template <class Value>
void take(const Json& json, const char* key, std::optional<Value>& value) {
  if (!json.contains(key)) return;
  if constexpr (std::is_integral_v<Value>) {
    value = whole<Value>(json[key]);
  } else {
    value = json[key].template get<Value>();
  }
}

void print_firmware(const FirmwareRequest& firmware, Json& json) {
  put(json, "generation", firmware.generation);
  if (!firmware.quirks.empty()) json["quirks"] = firmware.quirks;
}

FirmwareRequest parse_firmware(const Json& json) {
  FirmwareRequest firmware;
  take(json, "generation", firmware.generation);
  if (json.contains("quirks")) json["quirks"].get_to(firmware.quirks);
  return firmware;
}

Json print_overrides(const Overrides& overrides) {
  Json json = Json::object();
  for (const BusRequest& request : overrides.buses) {
    Json bus = {{"bus", request.interface}};
    put(bus, "ids", request.ids);
    print_firmware(request.firmware, bus);
    json["buses"].push_back(std::move(bus));
  }
  put(json, "motor", overrides.motor);
  put(json, "seed", overrides.seed);
  put(json, "bitrate", overrides.bitrate);
  put(json, "baud", overrides.baud);
  put(json, "boot_angle_deg", overrides.boot_angle_deg);
  print_firmware(overrides.firmware, json);
  return json;
}

Overrides parse_overrides(const Json& json) {
  Overrides overrides;
  for (const Json& bus : json.value("buses", Json::array())) {
    BusRequest request{bus.at("bus").get<std::string>(), std::nullopt, parse_firmware(bus)};
    if (bus.contains("ids")) {
      auto& ids = request.ids.emplace();
      for (const Json& id : bus["ids"]) ids.push_back(whole<int>(id));
    }
    overrides.buses.push_back(std::move(request));
  }
  overrides.firmware = parse_firmware(json);
  take(json, "motor", overrides.motor);
  take(json, "seed", overrides.seed);
  take(json, "bitrate", overrides.bitrate);
  take(json, "baud", overrides.baud);
  take(json, "boot_angle_deg", overrides.boot_angle_deg);
  return overrides;
}

/// Describes the buses, so that users recognise the recording.
Json describe_buses(const std::vector<BusConfig>& buses) {
  Json all = Json::array();
  for (const BusConfig& bus : buses) {
    Json ids = Json::array();
    for (const ServoConfig& servo : bus.servos) ids.push_back(servo.id);
    all.push_back(
        {{"bus", bus.interface}, {"ids", ids}, {"seed", bus.seed}, {"bitrate", bus.bitrate}});
  }
  return all;
}

/// Maps each requested motor name to the file name of the copy. A file that was requested under two
/// names has one copy; two files of the same name have two copies.
std::map<std::string, std::string> copies_of(const MotorFiles& motors) {
  std::map<std::string, std::string> copies;
  std::map<std::string, std::string> taken;  // copy to original
  for (const auto& [asked, motor] : motors) {
    std::string stem = motor.name;
    if (stem.ends_with(".toml")) stem.resize(stem.size() - 5);
    std::string copy = stem + ".toml";
    for (int n = 2; taken.emplace(copy, motor.file).first->second != motor.file; ++n) {
      copy = stem + "-" + std::to_string(n) + ".toml";
    }
    copies[asked] = copy;
  }
  return copies;
}

Json print_motors(const MotorFiles& motors) {
  Json json = Json::object();
  for (const auto& [asked, copy] : copies_of(motors)) {
    const MotorFile& motor = motors.at(asked);
    json[asked] = {{"name", motor.name}, {"file", motor.file}, {"copy", copy}};
  }
  return json;
}

std::string print_info(const RecordingInfo& info, const ConfigTexts& texts,
                       const std::vector<BusConfig>& buses) {
  const Json json = {{"format", kRecordingFormat},
                     {"lk_emu", info.version},
                     {"replayable", info.replayable},
                     {"started_utc", info.started_utc},
                     {"start_ns", info.start.count()},
                     {"clock", info.clock},
                     {"config", texts.config ? Json("config.toml") : Json(nullptr)},
                     {"config_file", texts.config_file},
                     {"motors", print_motors(texts.motors)},
                     {"command_line", print_overrides(info.overrides)},
                     {"buses", describe_buses(buses)}};
  return json.dump(2) + '\n';
}

/// A motor file of a recording.
struct RecordedMotor {
  std::string name;
  std::string file;  // original path
  fs::path copy;     // path in the recording
};

struct ParsedInfo {
  RecordingInfo info;
  bool has_config = false;
  std::string config_file;                      // original path
  std::map<std::string, RecordedMotor> motors;  // by requested name
};

std::map<std::string, RecordedMotor> parse_motors(const Json& json, const fs::path& directory) {
  std::map<std::string, RecordedMotor> motors;
  for (const auto& [asked, motor] : json.items()) {
    const auto copy = motor.at("copy").get<std::string>();
    if (copy.find('/') != std::string::npos) throw JsonError("motors", "a copy is elsewhere");
    motors[asked] = {motor.at("name").get<std::string>(), motor.at("file").get<std::string>(),
                     directory / "motors" / copy};
  }
  return motors;
}

ParsedInfo parse_info(const std::string& text, const fs::path& file) {
  try {
    const Json json = Json::parse(text);
    const int format = whole<int>(json.at("format"));
    if (format != kRecordingFormat) {
      throw StartError(file.string() + ": format " + std::to_string(format) +
                       " is not known to this version of lk-emu, " +
                       std::to_string(kRecordingFormat) + " is");
    }
    ParsedInfo parsed;
    parsed.info.version = json.at("lk_emu").get<std::string>();
    parsed.info.replayable = json.at("replayable").get<bool>();
    parsed.info.overrides = parse_overrides(json.at("command_line"));
    parsed.info.clock = json.at("clock").get<std::string>();
    parsed.info.start = SimTime(whole<std::int64_t>(json.at("start_ns")));
    parsed.info.started_utc = json.at("started_utc").get<std::string>();
    parsed.has_config = !json.at("config").is_null();
    parsed.config_file = json.value("config_file", "");
    parsed.motors = parse_motors(json.value("motors", Json::object()), file.parent_path());
    return parsed;
  } catch (const Json::exception& problem) {
    throw StartError(file.string() + ": not as lk-emu writes it: " + problem.what());
  } catch (const JsonError& problem) {
    throw StartError(file.string() + ": not as lk-emu writes it: " + problem.what());
  }
}

// --- files

/// Creates the files of a recording. The destructor removes them unless keep() was called: the next
/// recording needs an empty directory.
class CreatedFiles {
 public:
  explicit CreatedFiles(fs::path directory) : directory_(std::move(directory)) {}
  CreatedFiles(const CreatedFiles&) = delete;
  CreatedFiles& operator=(const CreatedFiles&) = delete;
  ~CreatedFiles() {
    std::error_code ignored;
    for (; !made_.empty(); made_.pop_back()) fs::remove(made_.back(), ignored);
  }

  void make_empty_directory() {
    std::error_code error;
    if (fs::create_directories(directory_, error)) made_.push_back(directory_);
    if (!error && !fs::is_empty(directory_, error) && !error) {
      throw StartError(directory_.string() +
                       " is not empty; a recording needs a directory of its own");
    }
    check(error);
  }
  void make_directory(const fs::path& directory) {
    std::error_code error;
    if (fs::create_directory(directory, error)) made_.push_back(directory);
    check(error);
  }
  void write(const fs::path& file, const std::string& text) {
    made_.push_back(file);
    errno = 0;
    std::ofstream stream(file, std::ios::binary);
    stream << text;
    stream.close();
    if (!stream) throw StartError("cannot write " + file.string() + ": " + errno_text(errno));
  }
  void keep() { made_.clear(); }

 private:
  void check(std::error_code error) const {
    if (!error) return;
    throw StartError("cannot record in " + directory_.string() + ": " + error.message());
  }

  fs::path directory_;
  std::vector<fs::path> made_;  // in order of creation
};

fs::path rom_file(const BusConfig& bus, const ServoConfig& servo) {
  return fs::path("rom") / rom_file_name(bus.interface, servo.id);
}

/// Returns a function that finds motor files by requested name. Their error messages have the
/// original path. Recordings of version 0.1.0 name the copies after the motor.
FindProfile recorded_profiles(const fs::path& directory, const ParsedInfo& parsed) {
  const FindMotorFile find_file = [&](const std::string& motor) -> MotorFile {
    const auto found = parsed.motors.find(motor);
    if (found == parsed.motors.end()) {
      const fs::path file = directory / "motors" / (motor + ".toml");
      if (is_path(motor) || !fs::exists(file)) {
        throw UnknownMotor("no motor \"" + motor + "\" in this recording");
      }
      return {motor, file.string(), read_regular_file(file, kLongestText)};
    }
    return {found->second.name, found->second.file,
            read_regular_file(found->second.copy, kLongestText), is_path(motor) ? "" : motor};
  };
  return
      [find_file](const std::string& motor) { return parse_profile(find_file(motor), find_file); };
}

std::vector<BusConfig> read_config(const fs::path& directory, const ParsedInfo& parsed) {
  const FindProfile find = recorded_profiles(directory, parsed);
  if (!parsed.has_config) return default_config(parsed.info.overrides, find);
  const fs::path copy = directory / "config.toml";
  const std::string file = parsed.config_file.empty() ? copy.string() : parsed.config_file;
  return parse_config(read_regular_file(copy, kLongestText), file, parsed.info.overrides, find);
}

/// Throws the error with the path of the copy in the recording, in place of the original path.
[[noreturn]] void fail_in_copy(const ConfigError& problem, const fs::path& directory,
                               const ParsedInfo& parsed) {
  std::string file = problem.file;
  if (file == parsed.config_file) file = (directory / "config.toml").string();
  for (const auto& [asked, motor] : parsed.motors) {
    if (problem.file == motor.file) file = motor.copy.string();
  }
  throw ConfigError(file, problem.line, problem.key, problem.reason);
}

std::vector<BusConfig> read_buses(const fs::path& directory, const ParsedInfo& parsed) {
  std::vector<BusConfig> buses;
  try {
    buses = read_config(directory, parsed);
  } catch (const ConfigError& problem) {
    fail_in_copy(problem, directory, parsed);
  }
  for (BusConfig& bus : buses) {
    for (ServoConfig& servo : bus.servos) {
      const fs::path rom = directory / rom_file(bus, servo);
      if (fs::exists(rom))
        read_rom(read_regular_file(rom, kLongestRom), rom.string(), bus.interface, servo);
    }
  }
  return buses;
}

/// Ignores a last line without a newline: the recording process was killed while writing it.
std::vector<RecordedInput> read_inputs(const fs::path& file) {
  const std::string text = read_regular_file(file, kLongestLog);
  std::vector<RecordedInput> inputs;
  int number = 0;
  for (std::size_t begin = 0, end = 0; (end = text.find('\n', begin)) != std::string::npos;
       begin = end + 1) {
    inputs.push_back(parse_input(text.substr(begin, end - begin), file.string(), ++number));
  }
  return inputs;
}

}  // namespace

// --- directives.jsonl

std::string print_input(const RecordedInput& input) {
  Json json = {
      {"time_ns", input.at.count()}, {"after_frames", input.after_frames}, {"bus", input.bus}};
  if (const auto* request = std::get_if<RecordedInput::Request>(&input.what)) {
    json["directive"] = Json::parse(request->json);
  } else if (const auto* rom = std::get_if<RecordedInput::RestoredRom>(&input.what)) {
    json["restored_rom"] = {{"id", rom->id}, {"wear", rom->wear}, {"rom", rom->rom}};
  } else {
    json["end"] = true;
  }
  return json.dump();
}

RecordedInput parse_input(const std::string& line, const std::string& file, int number) {
  try {
    const Json json = parse_json(line);
    RecordedInput input;
    input.at = SimTime(whole<std::int64_t>(json.at("time_ns")));
    input.after_frames = whole<std::uint64_t>(json.at("after_frames"));
    input.bus = json.at("bus").get<std::string>();
    if (json.contains("directive")) {
      input.what = RecordedInput::Request{json["directive"].dump()};
    } else if (json.contains("restored_rom")) {
      const Json& rom = json["restored_rom"];
      input.what = RecordedInput::RestoredRom{
          whole<int>(rom.at("id")), rom.at("rom").get<std::string>(), read_wear(rom.at("wear"))};
    } else if (json.contains("end")) {
      input.what = RecordedInput::End{};
    } else {
      throw ConfigError(file, number, "", "neither directive, restored_rom nor end is in it");
    }
    return input;
  } catch (const Json::exception& problem) {
    throw ConfigError(file, number, "", std::string("not as lk-emu writes it: ") + problem.what());
  } catch (const JsonError& problem) {
    throw ConfigError(file, number, problem.where, problem.what());
  }
}

RecordedInput::RestoredRom record_rom(const Registers& rom, const RomWear& wear,
                                      const std::string& bus, const ServoConfig& servo) {
  // A ROM file has only parameters with a write count. Here all get one, as a fault may have
  // damaged parameters that were never written.
  RomWear everything;
  everything.fill(1);
  return {servo.id, print_rom({bus, servo.id, servo.profile.name}, rom, everything), wear};
}

Registers restored_rom(const RecordedInput::RestoredRom& restored, const std::string& bus,
                       const ServoConfig& servo) {
  ServoConfig with_rom = servo;
  // print_rom leaves out these parameters if they are kAsWired.
  with_rom.rom.driver_id = kAsWired;
  with_rom.rom.bus_type = kAsWired;
  with_rom.rom.serial_rate = kAsWired;
  with_rom.rom.can_rate = kAsWired;
  read_rom(restored.rom, kInputsFile, bus, with_rom);
  return with_rom.rom;
}

// --- directory

void begin_recording(const fs::path& directory, const RecordingInfo& info, const ConfigTexts& texts,
                     const std::vector<BusConfig>& buses, const std::function<void()>& go_on) {
  CreatedFiles beginning(directory);
  beginning.make_empty_directory();
  for (const char* part : {"motors", "rom"}) beginning.make_directory(directory / part);
  for (const char* log : {kFramesFile, kInputsFile}) beginning.write(directory / log, "");
  if (texts.config) beginning.write(directory / "config.toml", *texts.config);
  for (const auto& [asked, copy] : copies_of(texts.motors)) {
    beginning.write(directory / "motors" / copy, texts.motors.at(asked).text);
  }
  for (const BusConfig& bus : buses) {
    for (const ServoConfig& servo : bus.servos) {
      if (!std::ranges::any_of(servo.wear, [](auto writes) { return writes > 0; })) continue;
      const RomOwner owner{bus.interface, servo.id, servo.profile.name};
      beginning.write(directory / rom_file(bus, servo), print_rom(owner, servo.rom, servo.wear));
    }
  }
  // This file is written last: a directory that has it is complete.
  beginning.write(directory / kRecordingFile, print_info(info, texts, buses));
  go_on();
  beginning.keep();
}

Recording read_recording(const fs::path& directory) {
  const fs::path file = directory / kRecordingFile;
  std::error_code ignored;
  if (!fs::exists(file, ignored)) {
    throw StartError(directory.string() + " is not a recording: it has no " + kRecordingFile +
                     " in it");
  }
  try {
    const ParsedInfo parsed = parse_info(read_regular_file(file, kLongestText), file);
    Recording recording{parsed.info, {}, {}};
    recording.buses = read_buses(directory, parsed);
    recording.inputs = read_inputs(directory / kInputsFile);
    return recording;
  } catch (const ConfigError& problem) {
    throw StartError(problem.what());
  } catch (const UnknownMotor& problem) {
    throw StartError(file.string() + ": " + problem.what());
  } catch (const std::invalid_argument& problem) {
    throw StartError(problem.what());
  }
}

}  // namespace lk::emulator
