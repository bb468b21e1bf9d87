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

/// Which files get the frames of a run.
struct FrameOutputs {
  std::optional<std::filesystem::path> candump;
  bool marks = false;  // T and R at the ends of its lines, which Wireshark does not read
  std::optional<std::filesystem::path> capture;  // pcapng
};

/// Files that get every frame, of both directions.
class FrameFiles {
 public:
  /// Throws StartError when a place cannot be written.
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
