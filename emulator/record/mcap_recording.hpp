#pragma once

/// @file A recording as one MCAP file (docs/record.md), for Foxglove and PlotJuggler.

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "emulator/frames/reply_values.hpp"
#include "emulator/record/log_writer.hpp"
#include "emulator/record/mcap_file.hpp"
#include "emulator/record/recording.hpp"

namespace lk::emulator {

/// A place whose name ends with .mcap is such a file, any other a directory.
bool is_mcap(const std::filesystem::path& place);

/// Takes the lines of directives.jsonl and frames.log, as they are, and makes messages of them.
class McapRecording : public LogSink {
 public:
  /// Makes the file, which must not be there yet, and attaches what is known at the beginning.
  /// Throws StartError; nothing is left then.
  McapRecording(const std::filesystem::path& file, const std::vector<RecordedText>& texts,
                const std::vector<BusConfig>& buses);

  int write(const Batch& batch) override;
  int finish(const std::string& last_inputs) override;

 private:
  struct Drive {
    ReplyReader reader;
    std::uint16_t channel;
  };
  struct Wire {
    std::uint16_t channel;
    std::vector<Drive> drives;
  };

  void begin(const std::vector<RecordedText>& texts, const std::vector<BusConfig>& buses);
  // False: the line is not as its log has lines.
  bool write_input(const std::string& line);
  bool write_frame(const std::string& line);

  std::optional<mcap::File> file_;
  std::uint16_t directives_ = 0;
  std::map<std::string, Wire, std::less<>> wires_;  // by the name of the bus
};

}  // namespace lk::emulator
