#pragma once

/// @file Reads and writes the directory of a recording (docs/reference/formats.md), which has
/// everything needed for a replay.

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
// Files in the directory, besides config.toml, rom/BUS-ID.toml and motors/*.toml.
inline constexpr const char* kRecordingFile = "recording.json";
inline constexpr const char* kFramesFile = "frames.log";
inline constexpr const char* kInputsFile = "directives.jsonl";
/// Index of each log in LogWriter, which writes them in this order: a frame is never written before
/// the directives that precede it.
enum RecordedLog : std::size_t { kInputs, kFrames };

/// Texts from which a configuration was read.
struct ConfigTexts {
  std::optional<std::string> config;  // absent: command line only
  std::string config_file;            // original path; relative paths in `config` refer to it
  MotorFiles motors;
};

/// Content of recording.json.
struct RecordingInfo {
  std::string version;      // version of the program that recorded
  bool replayable = true;   // recorded from the start of the simulation; else its state is unknown
  Overrides overrides;      // options of the command line
  std::string clock;        // "realtime", for display
  SimTime start{0};         // simulated time at the start of the recording
  std::string started_utc;  // for display
};

/// One line of directives.jsonl: an input of a bus besides configuration and frames.
struct RecordedInput {
  /// A requested directive, as a JSON object.
  struct Request {
    std::string json;
  };
  /// Values for Bus::restore_rom. `rom`: text of a ROM file with all parameters.
  struct RestoredRom {
    int id = 1;
    std::string rom;
    RomWear wear{};
  };
  /// The recording ends here, without an error.
  struct End {};

  SimTime at{0};
  std::uint64_t after_frames = 0;  // hosts' frames on all buses before this input
  std::string bus;
  std::variant<Request, RestoredRom, End> what;
};

/// Returns the line without a newline.
std::string print_input(const RecordedInput& input);
/// Parses line `number` of `file`. Throws ConfigError.
RecordedInput parse_input(const std::string& line, const std::string& file, int number);

RecordedInput::RestoredRom record_rom(const Registers& rom, const RomWear& wear,
                                      const std::string& bus, const ServoConfig& servo);
/// Returns the ROM registers in `restored`. `servo`: the drive's configuration. Throws ConfigError.
Registers restored_rom(const RecordedInput::RestoredRom& restored, const std::string& bus,
                       const ServoConfig& servo);

/// Writes all files of a recording, with empty logs, then calls `go_on`, which opens the logs.
/// `buses`: configuration with which the drives start. Throws StartError, for example if
/// `directory` is not empty, and what `go_on` throws. After an exception, no file of the recording
/// is left.
void begin_recording(
    const std::filesystem::path& directory, const RecordingInfo& info, const ConfigTexts& texts,
    const std::vector<BusConfig>& buses, const std::function<void()>& go_on = [] {});

/// A recording that was read, without its frames.
struct Recording {
  RecordingInfo info;
  std::vector<BusConfig> buses;  // configuration with which the drives started
  std::vector<RecordedInput> inputs;
};

/// Throws StartError if the recording is incomplete or invalid.
Recording read_recording(const std::filesystem::path& directory);

}  // namespace lk::emulator
