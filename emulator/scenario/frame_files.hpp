#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "emulator/core/bus_config.hpp"
#include "emulator/core/sim_time.hpp"
#include "emulator/files/output_file.hpp"
#include "protocol/frame.hpp"

namespace lk::emulator {

/// Files for the frames of a run.
struct FrameOutputs {
  std::optional<std::filesystem::path> candump;
  bool marks = false;  // append T or R to its lines; Wireshark does not read these
  std::optional<std::filesystem::path> capture;  // pcapng
};

/// Writes every frame, of both directions, to files.
class FrameFiles {
 public:
  /// Throws StartError if a file cannot be written.
  FrameFiles(const FrameOutputs& outputs, std::span<const BusConfig> buses);
  void write(std::size_t bus, SimTime at, const protocol::Frame& frame, bool from_host);
  void commit();

 private:
  std::vector<std::string> buses_;
  bool marks_;
  std::optional<OutputFile> candump_;
  std::optional<OutputFile> capture_;
};

}  // namespace lk::emulator
