#pragma once

#include <string>

#include "emulator/files/regular_file.hpp"

namespace lk::emulator {

/// Whether a terminal can be had at `path`: there is nothing, or a link of lk-emu's that leads
/// nowhere any more, or a serial port. `name` is the bus's. Throws StartError.
void check_terminal_path(const std::string& name, const std::string& path);
/// A character device, and no link of ours.
bool is_serial_device(const std::string& path);

/// A pseudo-terminal, and a link at a path by which hosts find it. The link goes with it.
class PtyLink {
 public:
  /// Raw, or as a fresh serial port is. Throws StartError.
  PtyLink(const std::string& name, std::string path, bool raw);
  PtyLink(const PtyLink&) = delete;
  PtyLink& operator=(const PtyLink&) = delete;
  ~PtyLink();

  /// Our side; it never blocks.
  int descriptor() const { return master_.get(); }

 private:
  std::string path_;
  std::string terminal_name_;
  Descriptor master_;
  Descriptor terminal_;  // as long as it is open here, hosts may come and go
};

}  // namespace lk::emulator
