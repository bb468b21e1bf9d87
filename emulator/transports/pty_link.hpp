#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cstdint>
#include <string>

#include "emulator/files/regular_file.hpp"

namespace lk::emulator {

/// Whether a terminal can be had at `path`: there is nothing, or a link of lk-emu's that leads
/// nowhere any more, or a serial port. `name` is the bus's. Throws StartError.
void check_terminal_path(const std::string& name, const std::string& path);
/// A character device, and no link of ours.
bool is_serial_device(const std::string& path);

/// A pseudo-terminal, and a link at a path by which hosts find it. The link goes with it. Bytes
/// that a host has not read when it closes the terminal are discarded, as by the driver of a serial
/// port.
class PtyLink {
 public:
  /// Raw, or as a fresh serial port is. Throws StartError.
  PtyLink(boost::asio::io_context& loop, const std::string& name, std::string path, bool raw);
  PtyLink(const PtyLink&) = delete;
  PtyLink& operator=(const PtyLink&) = delete;
  ~PtyLink();

  /// Our side; it never blocks.
  int descriptor() const { return master_.get(); }
  /// Discards unread bytes if a host has opened the terminal as the first one, or closed it as the
  /// last one. Call it after reading what hosts have written, and before replying: a host that was
  /// read has then been followed, and its replies stay.
  void follow_hosts();

 private:
  void wait_for_hosts();
  bool watch(std::uint32_t events);
  bool host_has_it_open();

  std::string path_;
  std::string terminal_name_;
  Descriptor master_;
  Descriptor terminal_;  // as long as it is open here, hosts may come and go
  boost::asio::posix::stream_descriptor events_;  // inotify's: hosts open and close the terminal
  bool has_host_ = false;                         // after the last event: a host has it open
};

}  // namespace lk::emulator
