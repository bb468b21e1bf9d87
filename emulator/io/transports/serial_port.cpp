#include "emulator/io/transports/serial_port.hpp"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <system_error>
#include <utility>

#include "emulator/core/start_error.hpp"
#include "emulator/io/transports/terminal.hpp"
#include "emulator/io/transports/wall_clock.hpp"
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

/// Converts a byte that was sent with other settings: it arrives, but with another value.
constexpr std::uint8_t misread(std::uint8_t byte) {
  return static_cast<std::uint8_t>(byte * 167U + 59U) | 0x80U;
}

}  // namespace

SerialPort::SerialPort(boost::asio::io_context& loop, std::string name, std::string path,
                       const SerialPortOptions& options, std::function<void()> on_frames)
    : name_(std::move(name)),
      path_(std::move(path)),
      options_(options),
      on_frames_(std::move(on_frames)),
      readiness_(loop),
      bytes_(kReadBytes) {
  check_terminal_path(name_, path_);
  if (is_serial_device(path_)) {
    open_device();
  } else {
    pty_.emplace(loop, name_, path_, !options_.as_tty);
  }
  watch();
}

SerialPort::~SerialPort() {
  if (readiness_.is_open()) readiness_.release();  // its owner closes the descriptor
}

void SerialPort::open_device() {
  fd_ = Descriptor(::open(path_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!fd_) throw StartError(name_ + ": cannot open " + path_ + ": " + errno_text(errno));
  if (::isatty(fd_.get()) == 0) throw StartError(name_ + ": " + path_ + " is not a serial port");
  if (::ioctl(fd_.get(), TIOCEXCL) != 0) throw StartError(name_ + ": " + errno_text(errno));
  try {
    make_raw(fd_.get(), options_.bitrate);
  } catch (const std::system_error& problem) {
    throw StartError(name_ + ": cannot set " + path_ + ": " + problem.what());
  }
}

/// Reopens a port that was unplugged.
void SerialPort::check_link() {
  if (is_up() || !is_serial_device(path_)) return;
  try {
    open_device();
    watch();
    missing_logged_ = false;
    spdlog::info("{} is up: continuing", name_);
  } catch (const StartError& problem) {
    if (!std::exchange(missing_logged_, true)) spdlog::warn("{}", problem.what());
  }
}

void SerialPort::watch() {
  boost::system::error_code error;
  readiness_.assign(descriptor(), error);
  if (error) throw StartError(name_ + ": " + error.message());
  wait_readable();
}

void SerialPort::wait_readable() {
  readiness_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                        [this](const boost::system::error_code& error) {
                          if (error) return;
                          on_frames_();
                          if (is_up()) wait_readable();
                        });
}

bool SerialPort::is_understood() {
  if (!pty_ || !options_.enforces_rate) return true;
  const LineSettings host = line_settings_of(descriptor());
  std::string mismatch;
  if (options_.bitrate > 0 && host.rate != options_.bitrate) {
    mismatch = "is at " + std::to_string(host.rate) + " bit/s and the drives are at " +
               std::to_string(options_.bitrate);
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

Port::Batch SerialPort::next_batch(Wait /*wait*/) {
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

void SerialPort::note_error(int error) {
  spdlog::warn("{}: {} is gone ({}): waiting until it is back", name_, path_, errno_text(error));
  ++stats_.link_losses;
  readiness_.release();
  fd_ = Descriptor();
  pty_.reset();
}

void SerialPort::send(std::span<const protocol::Frame> frames) {
  for (const protocol::Frame& frame : frames) {
    if (!is_up()) {
      ++stats_.lost_link_down;
      continue;
    }
    if (!is_understood()) {  // the host would receive garbage
      ++stats_.sent;
      continue;
    }
    const protocol::WireBytes bytes = protocol::wire_bytes(frame);
    const ssize_t written = ::write(descriptor(), bytes.bytes.data(), bytes.size);
    // Unread bytes are lost, as in the buffer of a real port.
    ++(written == static_cast<ssize_t>(bytes.size) ? stats_.sent : stats_.lost_queue_full);
  }
}

}  // namespace lk::emulator
