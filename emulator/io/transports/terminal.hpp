#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cstdint>
#include <string>

#include "emulator/core/terminal_flag.hpp"
#include "emulator/files/durable_file.hpp"

namespace lk::emulator {

/// Settings that both ends of a serial line must share. On a pseudo-terminal, Linux removes PARENB
/// and CS7 (pty_set_termios) but keeps PARODD: even parity and 7 bits cannot be detected.
struct LineSettings {
  std::int64_t rate = 0;  // output rate, bit/s
  bool two_stop_bits = false;
  bool odd_parity = false;
};
/// Returns the settings that the host has made at the slave side; `fd` is the master of the
/// pseudo-terminal. Throws std::system_error.
LineSettings line_settings_of(int fd);
/// Returns the settings by which a terminal that is not raw changes bytes. Throws
/// std::system_error.
TerminalFlags flags_of(int fd);
/// Sets raw mode: bytes unchanged, no flow control, 8 bits, no parity, 1 stop bit. Rate 0 keeps the
/// current rate. Throws std::system_error.
void make_raw(int fd, std::int64_t rate);

/// Checks that a bus can use `path`: nothing is there, or a dead link of lk-emu, or a serial port.
/// `name`: name of the bus. Throws StartError if not.
void check_terminal_path(const std::string& name, const std::string& path);
/// Returns true if `path` is a character device, but not a link to a pseudo-terminal.
bool is_serial_device(const std::string& path);

/// A pseudo-terminal, and a link at `path` by which hosts open it; the destructor removes the link.
/// Bytes that a host has not read when it closes the terminal are discarded, as by a serial driver.
class PtyLink {
 public:
  /// `raw`: raw mode; otherwise the defaults of a serial port. Throws StartError.
  PtyLink(boost::asio::io_context& loop, const std::string& name, std::string path, bool raw);
  PtyLink(const PtyLink&) = delete;
  PtyLink& operator=(const PtyLink&) = delete;
  ~PtyLink();

  /// Master side, non-blocking.
  int descriptor() const { return master_.get(); }
  /// Discards unread bytes if a first host has opened the terminal or the last one has closed it.
  /// Call it after reading and before replying, so that it does not discard replies to this host.
  void handle_host_events();
  /// Returns whether a host had the terminal open at the last event; true if events are
  /// unavailable.
  bool has_host() const { return !events_.is_open() || has_host_; }

 private:
  void wait_for_hosts();
  bool watch(std::uint32_t events);
  bool host_has_it_open();

  std::string path_;
  std::string terminal_name_;
  Descriptor master_;
  Descriptor terminal_;                           // kept open, so that hosts may come and go
  boost::asio::posix::stream_descriptor events_;  // inotify: opens and closes by hosts
  bool has_host_ = false;  // a host had the terminal open after the last event
};

}  // namespace lk::emulator
