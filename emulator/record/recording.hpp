#pragma once

/// @file The directory of a recording (docs/record.md): all it takes to run it again.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "emulator/config/config.hpp"
#include "emulator/files/profile_files.hpp"

namespace lk::emulator {

inline constexpr int kRecordingFormat = 1;
// Its files; rom/BUS-ID.toml and motors/*.toml besides.
inline constexpr const char* kRecordingFile = "recording.json";
inline constexpr const char* kFramesFile = "frames.log";
inline constexpr const char* kInputsFile = "directives.jsonl";
/// The logs in the order in which a batch is written: a frame is never there without the directives
/// before it.
enum RecordedLog : std::size_t { kInputs, kFrames };

/// The texts that a configuration was read from.
struct ConfigTexts {
  std::optional<std::string> config;  // none: the command line said it all
  std::string config_file;            // where it was: paths in it start there
  MotorFiles motors;
};

/// recording.json.
struct RecordingInfo {
  std::string version;      // of the program that wrote it
  bool replayable = true;   // begun with the simulation: what came before it is not known otherwise
  Overrides overrides;      // what the command line said
  std::string clock;        // "realtime", for people
  SimTime start{0};         // simulated time of its beginning
  std::string started_utc;  // for people
};

/// One line of directives.jsonl: what acted on a bus and is neither configuration nor frame.
struct RecordedInput {
  /// A directive as it was asked for, a JSON object.
  struct Request {
    std::string json;
  };
  /// What Bus::restore_rom was told: all of the ROM, as a ROM file that counts every parameter.
  struct RestoredRom {
    int id = 1;
    std::string rom;
    RomWear wear{};
  };
  /// The recording ends here, in good order.
  struct End {};

  SimTime at{0};
  std::uint64_t after_frames = 0;  // hosts' frames of all buses that were there before it
  std::string bus;
  std::variant<Request, RestoredRom, End> what;
};

/// Without the end of line.
std::string print_input(const RecordedInput& input);
/// Throws ConfigError.
RecordedInput parse_input(const std::string& line, const std::string& file, int number);

RecordedInput::RestoredRom record_rom(const Registers& rom, const RomWear& wear,
                                      const std::string& bus, const ServoConfig& servo);
/// The registers of `restored`; `servo` is the drive's configuration. Throws ConfigError.
Registers restored_rom(const RecordedInput::RestoredRom& restored, const std::string& bus,
                       const ServoConfig& servo);

/// Writes all that is known at the beginning; `buses` are as the drives start. `go_on` then opens
/// the logs. Throws StartError, so when there is something in `directory` already, and whatever
/// `go_on` throws: nothing is left then.
void begin_recording(
    const std::filesystem::path& directory, const RecordingInfo& info, const ConfigTexts& texts,
    const std::vector<BusConfig>& buses, const std::function<void()>& go_on = [] {});

/// A recording that was read; its frames are not.
struct Recording {
  RecordingInfo info;
  std::vector<BusConfig> buses;  // as the drives started
  std::vector<RecordedInput> inputs;
};

/// Throws StartError with what is wrong with it.
Recording read_recording(const std::filesystem::path& directory);

}  // namespace lk::emulator
