#include "emulator/transports/serial_port.hpp"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <climits>
#include <cstdlib>
#include <system_error>
#include <utility>

#include "emulator/ground/start_error.hpp"
#include "emulator/transports/terminal.hpp"
#include "protocol/serial_framing.hpp"

namespace lk::emulator {
namespace {

/// What is read at once: as much as the kernel keeps for a terminal.
constexpr std::size_t kReadBytes = 4096;
constexpr const char* kTerminals = "/dev/pts/";

std::string reason(int error) { return std::generic_category().message(error); }

/// Where a link leads; empty: it is none.
std::string target_of(const std::string& path) {
  std::array<char, PATH_MAX> target{};
  const ssize_t size = ::readlink(path.c_str(), target.data(), target.size());
  return size > 0 ? std::string(target.data(), static_cast<std::size_t>(size)) : "";
}

/// A link that lk-emu made and could not remove: its terminal is gone.
bool is_dead_link(const std::string& path) {
  struct stat found {};
  return target_of(path).starts_with(kTerminals) && ::stat(path.c_str(), &found) != 0;
}

bool is_device(const std::string& path) {
  struct stat found {};
  return ::stat(path.c_str(), &found) == 0 && S_ISCHR(found.st_mode) &&
         !target_of(path).starts_with(kTerminals);
}

std::chrono::nanoseconds wall_clock() {
  return std::chrono::system_clock::now().time_since_epoch();
}

}  // namespace

void check_serial_path(const std::string& name, const std::string& path) {
  struct stat found {};
  if (::lstat(path.c_str(), &found) != 0) {
    if (errno == ENOENT) return;
    throw StartError(name + ": " + reason(errno));
  }
  if (is_device(path) || is_dead_link(path)) return;
  if (target_of(path).starts_with(kTerminals)) {
    throw StartError(name + ": " + path +
                     " leads to a terminal that somebody has open; remove the "
                     "link, or give another path");
  }
  throw StartError(name + ": " + path +
                   " is there already, and is neither a link of lk-emu's nor a serial port; "
                   "remove it, or give another path");
}

SerialPort::SerialPort(boost::asio::io_context& loop, std::string name, std::string path,
                       const SerialPortOptions& options, std::function<void()> on_frames)
    : name_(std::move(name)),
      path_(std::move(path)),
      options_(options),
      on_frames_(std::move(on_frames)),
      readiness_(loop),
      bytes_(kReadBytes) {
  check_serial_path(name_, path_);
  if (is_device(path_)) {
    open_device();
  } else {
    open_pty();
  }
  watch();
}

SerialPort::~SerialPort() {
  if (readiness_.is_open()) readiness_.release();  // the descriptor closes itself
  if (!linked_.empty() && target_of(path_) == linked_) ::unlink(path_.c_str());
}

void SerialPort::open_pty() {
  // Now, as the new terminal may get the number that the old one had.
  if (is_dead_link(path_)) ::unlink(path_.c_str());
  fd_ = Descriptor(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  std::array<char, 64> terminal{};
  if (!fd_ || ::grantpt(fd_.get()) != 0 || ::unlockpt(fd_.get()) != 0 ||
      ::ptsname_r(fd_.get(), terminal.data(), terminal.size()) != 0) {
    throw StartError(name_ + ": no pseudo-terminal: " + reason(errno));
  }
  terminal_ = Descriptor(::open(terminal.data(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  if (!terminal_) throw StartError(name_ + ": " + terminal.data() + ": " + reason(errno));
  if (!options_.as_tty) make_raw(terminal_.get(), 0);
  link_to(terminal.data());
}

void SerialPort::link_to(const std::string& terminal) {
  if (::symlink(terminal.c_str(), path_.c_str()) != 0) {
    throw StartError(name_ + ": cannot make the link " + path_ + ": " + reason(errno));
  }
  linked_ = terminal;
}

void SerialPort::open_device() {
  fd_ = Descriptor(::open(path_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!fd_) throw StartError(name_ + ": cannot open " + path_ + ": " + reason(errno));
  if (::isatty(fd_.get()) == 0) throw StartError(name_ + ": " + path_ + " is no serial port");
  if (::ioctl(fd_.get(), TIOCEXCL) != 0) throw StartError(name_ + ": " + reason(errno));
  try {
    make_raw(fd_.get(), options_.bitrate);
  } catch (const std::system_error& problem) {
    throw StartError(name_ + ": cannot set " + path_ + ": " + problem.what());
  }
}

/// A port that was unplugged may be back.
void SerialPort::check_link() {
  if (is_up() || !is_device(path_)) return;
  try {
    open_device();
    watch();
    told_missing_ = false;
    spdlog::info("{} is up: continuing", name_);
  } catch (const StartError& problem) {
    if (!std::exchange(told_missing_, true)) spdlog::warn("{}", problem.what());
  }
}

void SerialPort::watch() {
  boost::system::error_code error;
  readiness_.assign(fd_.get(), error);
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

bool SerialPort::rate_is_right() {
  if (!linked_.empty() && options_.enforces_rate && options_.bitrate > 0) {
    const std::int64_t rate = output_rate(fd_.get());
    const bool wrong = rate != options_.bitrate;
    if (wrong && !wrong_rate_) {
      spdlog::warn("{}: the host is at {} bit/s and the drives are at {}: nobody understands it",
                   name_, rate, options_.bitrate);
    }
    wrong_rate_ = wrong;
  }
  return !wrong_rate_;
}

TerminalFlags SerialPort::host_flags() const {
  return linked_.empty() || !is_up() ? TerminalFlags{} : flags_of(fd_.get());
}

Port::Batch SerialPort::next_batch(Wait /*wait*/) {
  const ssize_t size = ::read(fd_.get(), bytes_.data(), bytes_.size());
  if (size <= 0) {
    const bool nothing = size < 0 && (errno == EAGAIN || errno == EINTR);
    return {{}, false, nothing ? 0 : size == 0 ? EIO : errno};
  }
  std::span<std::uint8_t> bytes(bytes_.data(), static_cast<std::size_t>(size));
  if (!rate_is_right()) {
    // Bits of another length: something arrives, and nothing of it is what was sent.
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(byte * 167U + 59U) | 0x80U;
  }
  frames_.clear();
  protocol::append_frames(bytes, frames_);
  received_.clear();
  const auto stamp = wall_clock();
  for (const protocol::Frame& frame : frames_) received_.push_back({stamp, frame});
  return {received_, bytes.size() == bytes_.size(), 0};
}

void SerialPort::note_error(int error) {
  spdlog::warn("{}: {} is gone ({}): waiting until it is back", name_, path_, reason(error));
  ++stats_.link_losses;
  readiness_.release();
  fd_ = Descriptor();
}

void SerialPort::send(std::span<const protocol::Frame> frames) {
  for (const protocol::Frame& frame : frames) {
    if (!is_up()) {
      ++stats_.lost_link_down;
      continue;
    }
    if (!rate_is_right()) {  // a host at another rate reads rubbish, if anything
      ++stats_.sent;
      continue;
    }
    const protocol::WireBytes bytes = protocol::wire_bytes(frame);
    const ssize_t written = ::write(fd_.get(), bytes.bytes.data(), bytes.size);
    // What nobody reads is lost, as in the buffer of a real port.
    ++(written == static_cast<ssize_t>(bytes.size) ? stats_.sent : stats_.lost_queue_full);
  }
}

}  // namespace lk::emulator
