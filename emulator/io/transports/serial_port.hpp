#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "emulator/files/output_file.hpp"
#include "emulator/io/transports/client_set.hpp"
#include "emulator/io/transports/port.hpp"
#include "emulator/io/transports/pty_link.hpp"

namespace lk::emulator {

/// RS-485 over TCP: bytes of packets in both directions, unchanged.
class SerialBytes final : public ClientProtocol {
 public:
  void parse(std::span<const std::uint8_t> bytes, Time now, ParsedInput& parsed) override;
  void encode(const protocol::Frame& frame, Time now, std::string& out) override;
};

/// Settings of a serial port (docs/reference/rs485.md).
struct SerialPortOptions {
  std::int64_t bitrate = 0;   // of the bus; 0: any rate that hosts set
  bool as_tty = true;         // pseudo-terminal starts with serial-port defaults, not raw
  bool enforces_rate = true;  // bytes of a host at another rate, or not at 8N1, are garbled
};

/// An RS-485 bus for hosts: a pseudo-terminal with a link at a path, or a real serial port there.
/// Bytes of one write follow each other without a gap on the modelled wire, from their arrival on.
class SerialPort final : public Port {
 public:
  /// `name` is the bus's. Opens the port or creates the link. Throws StartError.
  SerialPort(boost::asio::io_context& loop, std::string name, std::string path,
             const SerialPortOptions& options, std::function<void()> on_frames);
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;
  ~SerialPort() override;

  void check_link() override;
  bool is_up() const override { return descriptor() >= 0; }
  bool can_wait() const override { return false; }
  void send(std::span<const protocol::Frame> frames) override;
  int descriptor() const override { return pty_ ? pty_->descriptor() : fd_ ? fd_.get() : -1; }
  std::size_t pending() const override { return 0; }
  PortStats stats() const override { return stats_; }
  const TerminalFlags& host_flags() const override { return host_flags_; }

 private:
  Batch next_batch(Wait wait) override;
  void note_error(int error) override;
  void open_device();
  void watch();
  void wait_readable();
  /// Returns whether the host's settings match the drives'; warns when the mismatch changes.
  bool is_understood();

  std::string name_;
  std::string path_;
  SerialPortOptions options_;
  std::function<void()> on_frames_;
  std::optional<PtyLink> pty_;  // either this
  Descriptor fd_;               // or the serial port itself
  boost::asio::posix::stream_descriptor readiness_;
  TerminalFlags host_flags_;
  std::string mismatch_;  // of host and drives, for the log; empty: none
  bool missing_logged_ = false;
  PortStats stats_;
  std::vector<std::uint8_t> bytes_;
  std::vector<protocol::Frame> frames_;
  std::vector<ReceivedFrame> received_;
};

}  // namespace lk::emulator
