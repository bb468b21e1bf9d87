#pragma once

/// @file The directory of a recording (docs/reference/formats.md): everything needed to run it
/// again.

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
// Files in it, besides rom/BUS-ID.toml and motors/*.toml.
inline constexpr const char* kRecordingFile = "recording.json";
inline constexpr const char* kFramesFile = "frames.log";
inline constexpr const char* kInputsFile = "directives.jsonl";
/// Order of the logs in a batch: a frame is never written before the directives that precede it.
enum RecordedLog : std::size_t { kInputs, kFrames };

/// Texts from which a configuration was read.
struct ConfigTexts {
  std::optional<std::string> config;  // absent: command line only
  std::string config_file;            // its original path; relative paths start there
  MotorFiles motors;
};

/// Content of recording.json.
struct RecordingInfo {
  std::string version;      // version of the program that recorded
  bool replayable = true;   // started with the simulation; otherwise the earlier state is unknown
  Overrides overrides;      // options of the command line
  std::string clock;        // "realtime", for display
  SimTime start{0};         // simulated time at its start
  std::string started_utc;  // for display
};

/// One line of directives.jsonl: an input of a bus besides configuration and frames.
struct RecordedInput {
  /// A requested directive, as a JSON object.
  struct Request {
    std::string json;
  };
  /// Values for Bus::restore_rom: the whole ROM, as a ROM file that counts every parameter.
  struct RestoredRom {
    int id = 1;
    std::string rom;
    RomWear wear{};
  };
  /// The recording ends here, without an error.
  struct End {};

  SimTime at{0};
  std::uint64_t after_frames = 0;  // hosts' frames on all buses before it
  std::string bus;
  std::variant<Request, RestoredRom, End> what;
};

/// Returns the line without its end.
std::string print_input(const RecordedInput& input);
/// Throws ConfigError.
RecordedInput parse_input(const std::string& line, const std::string& file, int number);

RecordedInput::RestoredRom record_rom(const Registers& rom, const RomWear& wear,
                                      const std::string& bus, const ServoConfig& servo);
/// Returns the registers of `restored`. `servo`: the drive's configuration. Throws ConfigError.
Registers restored_rom(const RecordedInput::RestoredRom& restored, const std::string& bus,
                       const ServoConfig& servo);

/// Writes all that is known at the beginning; `buses` are as the drives start. `go_on` then opens
/// the logs. Throws StartError, so when there is something in `directory` already, and whatever
/// `go_on` throws: nothing is left then.
void begin_recording(
    const std::filesystem::path& directory, const RecordingInfo& info, const ConfigTexts& texts,
    const std::vector<BusConfig>& buses, const std::function<void()>& go_on = [] {});

/// A recording that was read, without its frames.
struct Recording {
  RecordingInfo info;
  std::vector<BusConfig> buses;  // as the drives started
  std::vector<RecordedInput> inputs;
};

/// Throws StartError with the error in the recording.
Recording read_recording(const std::filesystem::path& directory);

}  // namespace lk::emulator
