#include "emulator/io/transports/serial_port.hpp"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "emulator/core/start_error.hpp"
#include "emulator/io/transports/terminal.hpp"
#include "protocol/serial_framing.hpp"

namespace lk::emulator {

void SerialBytes::parse(std::span<const std::uint8_t> bytes, Time /*now*/, ParsedInput& parsed) {
  protocol::append_frames(bytes, parsed.frames);
}

void SerialBytes::encode(const protocol::Frame& frame, Time /*now*/, std::string& out) {
  const protocol::WireBytes wire = protocol::wire_bytes(frame);
  out.append(wire.view().begin(), wire.view().end());
}

namespace {

/// Bytes per read: as much as the kernel buffers for a terminal.
constexpr std::size_t kReadBytes = 4096;

/// Returns what a drive reads of a byte that was sent with other line settings: a wrong value.
constexpr std::uint8_t misread(std::uint8_t byte) {
  return static_cast<std::uint8_t>(byte * 167U + 59U) | 0x80U;
}

class SerialPort final : public Port {
 public:
  SerialPort(boost::asio::io_context& loop, const BusConfig& bus, std::string path,
             std::function<void()> on_frames)
      : name_(bus.interface),
        path_(std::move(path)),
        bitrate_(bus.bitrate),
        enforces_rate_(bus.serial->enforces_rate),
        readiness_(loop, std::move(on_frames)),
        bytes_(kReadBytes) {
    check_terminal_path(name_, path_);
    if (is_serial_device(path_)) {
      open_device();
    } else {
      pty_.emplace(loop, name_, path_, !bus.serial->as_tty);
    }
    start();
  }

  bool is_up() const override { return descriptor() >= 0; }
  bool can_wait() const override { return false; }
  int descriptor() const override { return pty_ ? pty_->descriptor() : fd_ ? fd_.get() : -1; }
  std::size_t pending() const override { return 0; }
  PortStats stats() const override { return stats_; }
  const TerminalFlags& host_flags() const override { return host_flags_; }

  /// Reopens a port that was unplugged.
  void check_link() override {
    if (is_up() || !is_serial_device(path_)) return;
    try {
      open_device();
      start();
      missing_logged_ = false;
      spdlog::info("{} is up: continuing", name_);
    } catch (const StartError& problem) {
      fd_ = Descriptor();  // the next check tries again
      if (!std::exchange(missing_logged_, true)) spdlog::warn("{}", problem.what());
    }
  }

  void send(std::span<const protocol::Frame> frames) override {
    for (const protocol::Frame& frame : frames) {
      if (!is_up()) {
        ++stats_.lost_link_down;
        continue;
      }
      // Not sent, but counted: there is no host, or it would receive garbage.
      if ((pty_ && !pty_->has_host()) || !is_understood()) {
        ++stats_.sent;
        continue;
      }
      const protocol::WireBytes bytes = protocol::wire_bytes(frame);
      const ssize_t written = ::write(descriptor(), bytes.bytes.data(), bytes.size);
      // If the host does not read and the buffer is full, the reply is lost, as on a real port.
      ++(written == static_cast<ssize_t>(bytes.size) ? stats_.sent : stats_.lost_queue_full);
    }
  }

 private:
  Batch next_batch(Wait /*wait*/) override {
    const ssize_t size = ::read(descriptor(), bytes_.data(), bytes_.size());
    const int error = size < 0 ? errno : EIO;
    if (pty_) pty_->handle_host_events();
    if (size <= 0) return {{}, false, error == EAGAIN || error == EINTR ? 0 : error};
    std::span<std::uint8_t> bytes(bytes_.data(), static_cast<std::size_t>(size));
    if (pty_) host_flags_ = flags_of(descriptor());
    if (!is_understood()) {
      for (std::uint8_t& byte : bytes) byte = misread(byte);
    }
    frames_.clear();
    protocol::append_frames(bytes, frames_);
    received_.clear();
    const auto stamp = wall_now();
    for (const protocol::Frame& frame : frames_) received_.push_back({stamp, frame});
    return {received_, bytes.size() == bytes_.size(), 0};
  }

  void note_error(int error) override {
    spdlog::warn("{}: {} is gone ({}): waiting until it is back", name_, path_, errno_text(error));
    ++stats_.link_losses;
    readiness_.release();
    fd_ = Descriptor();
    pty_.reset();
  }

  void start() {
    if (const auto error = readiness_.watch(descriptor())) {
      throw StartError(name_ + ": " + error.message());
    }
  }

  void open_device() {
    fd_ = Descriptor(::open(path_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
    if (!fd_) throw StartError(name_ + ": cannot open " + path_ + ": " + errno_text(errno));
    if (::isatty(fd_.get()) == 0) throw StartError(name_ + ": " + path_ + " is not a serial port");
    if (::ioctl(fd_.get(), TIOCEXCL) != 0) throw StartError(name_ + ": " + errno_text(errno));
    try {
      make_raw(fd_.get(), bitrate_);
    } catch (const std::system_error& problem) {
      throw StartError(name_ + ": cannot set " + path_ + ": " + problem.what());
    }
  }

  /// Returns whether the host's settings match the drives'; warns when the mismatch changes.
  bool is_understood() {
    if (!pty_ || !enforces_rate_) return true;
    const LineSettings host = line_settings_of(descriptor());
    std::string mismatch;
    if (bitrate_ > 0 && host.rate != bitrate_) {
      mismatch = "is at " + std::to_string(host.rate) + " bit/s and the drives are at " +
                 std::to_string(bitrate_);
    } else if (host.two_stop_bits) {
      mismatch = "has two stop bits and the drives have one";
    } else if (host.odd_parity) {
      mismatch = "has odd parity and the drives have none";
    }
    if (!mismatch.empty() && mismatch != mismatch_) {
      spdlog::warn("{}: the host {}: no drive understands it", name_, mismatch);
    }
    mismatch_ = std::move(mismatch);
    return mismatch_.empty();
  }

  std::string name_;
  std::string path_;
  std::int64_t bitrate_;        // of the bus, bit/s; 0: any rate that the host sets
  bool enforces_rate_;          // bytes of a host at another rate, or not at 8N1, are garbled
  std::optional<PtyLink> pty_;  // the pseudo-terminal, if it is one
  Descriptor fd_;               // otherwise the real serial port
  Readiness readiness_;         // of pty_ or fd_
  TerminalFlags host_flags_;
  std::string mismatch_;  // present mismatch of host and drives, logged; empty: none
  bool missing_logged_ = false;
  PortStats stats_;
  std::vector<std::uint8_t> bytes_;
  std::vector<protocol::Frame> frames_;
  std::vector<ReceivedFrame> received_;
};

}  // namespace

std::unique_ptr<Port> make_serial_port(boost::asio::io_context& loop, const BusConfig& bus,
                                       const std::string& path, std::function<void()> on_frames) {
  return std::make_unique<SerialPort>(loop, bus, path, std::move(on_frames));
}

}  // namespace lk::emulator
