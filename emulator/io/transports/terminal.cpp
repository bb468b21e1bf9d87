#include "emulator/io/transports/terminal.hpp"

#include <asm/termbits.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/inotify.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <utility>

#include "emulator/core/start_error.hpp"

namespace lk::emulator {
namespace {

termios2 settings_of(int fd) {
  termios2 settings{};
  if (::ioctl(fd, TCGETS2, &settings) < 0) {
    throw std::system_error(errno, std::generic_category(), "TCGETS2");
  }
  return settings;
}

constexpr const char* kTerminals = "/dev/pts/";

/// Returns the target of a link; empty if `path` is no link.
std::string target_of(const std::string& path) {
  std::array<char, PATH_MAX> target{};
  const ssize_t size = ::readlink(path.c_str(), target.data(), target.size());
  return size > 0 ? std::string(target.data(), static_cast<std::size_t>(size)) : "";
}

/// Returns true for a link to a pseudo-terminal that is gone: left by an lk-emu that was killed.
bool is_dead_link(const std::string& path) {
  struct stat found {};
  return target_of(path).starts_with(kTerminals) && ::stat(path.c_str(), &found) != 0;
}

}  // namespace

LineSettings line_settings_of(int fd) {
  const termios2 settings = settings_of(fd);
  return {.rate = settings.c_ospeed,
          .two_stop_bits = (settings.c_cflag & CSTOPB) != 0,
          .odd_parity = (settings.c_cflag & PARODD) != 0};
}

TerminalFlags flags_of(int fd) {
  const termios2 settings = settings_of(fd);
  TerminalFlags flags;
  const auto add = [&flags](tcflag_t set, TerminalFlag flag) {
    if (set != 0) flags.push_back(flag);
  };
  add(settings.c_iflag & ICRNL, TerminalFlag::kIcrnl);
  add(settings.c_iflag & INLCR, TerminalFlag::kInlcr);
  add(settings.c_iflag & IGNCR, TerminalFlag::kIgncr);
  add(settings.c_iflag & ISTRIP, TerminalFlag::kIstrip);
  add(settings.c_iflag & IXON, TerminalFlag::kIxon);
  add(settings.c_oflag & OPOST, TerminalFlag::kOpost);
  add(settings.c_lflag & ECHO, TerminalFlag::kEcho);
  return flags;
}

void make_raw(int fd, std::int64_t rate) {
  termios2 settings = settings_of(fd);
  settings.c_iflag = 0;
  settings.c_oflag = 0;
  settings.c_lflag = 0;
  settings.c_cflag &= ~static_cast<tcflag_t>(CSIZE | PARENB | CSTOPB | CRTSCTS);
  settings.c_cflag |= CS8 | CREAD | CLOCAL;
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  if (rate > 0) {
    settings.c_cflag &= ~static_cast<tcflag_t>(CBAUD | (CBAUD << IBSHIFT));
    settings.c_cflag |= BOTHER | (BOTHER << IBSHIFT);
    settings.c_ispeed = static_cast<speed_t>(rate);
    settings.c_ospeed = static_cast<speed_t>(rate);
  }
  if (::ioctl(fd, TCSETS2, &settings) < 0) {
    throw std::system_error(errno, std::generic_category(), "TCSETS2");
  }
}

bool is_serial_device(const std::string& path) {
  struct stat found {};
  return ::stat(path.c_str(), &found) == 0 && S_ISCHR(found.st_mode) &&
         !target_of(path).starts_with(kTerminals);
}

void check_terminal_path(const std::string& name, const std::string& path) {
  struct stat found {};
  if (::lstat(path.c_str(), &found) != 0) {
    if (errno == ENOENT) return;
    throw StartError(name + ": " + errno_text(errno));
  }
  if (is_serial_device(path) || is_dead_link(path)) return;
  if (target_of(path).starts_with(kTerminals)) {
    throw StartError(name + ": " + path +
                     " leads to a terminal that is open; remove the link, or give another path");
  }
  throw StartError(name + ": " + path +
                   " already exists and is neither a link of lk-emu nor a serial port; remove it, "
                   "or give another path");
}

PtyLink::PtyLink(boost::asio::io_context& loop, const std::string& name, std::string path, bool raw)
    : path_(std::move(path)), events_(loop) {
  // Before posix_openpt: the new terminal may get the number of the old one, and the link would
  // then not be dead.
  if (is_dead_link(path_)) ::unlink(path_.c_str());
  master_ = Descriptor(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  std::array<char, 64> terminal{};
  if (!master_ || ::grantpt(master_.get()) != 0 || ::unlockpt(master_.get()) != 0 ||
      ::ptsname_r(master_.get(), terminal.data(), terminal.size()) != 0) {
    throw StartError(name + ": no pseudo-terminal: " + errno_text(errno));
  }
  terminal_ = Descriptor(::open(terminal.data(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  if (!terminal_) throw StartError(name + ": " + terminal.data() + ": " + errno_text(errno));
  if (raw) make_raw(terminal_.get(), 0);
  if (::symlink(terminal.data(), path_.c_str()) != 0) {
    throw StartError(name + ": cannot make the link " + path_ + ": " + errno_text(errno));
  }
  terminal_name_ = terminal.data();
  // Without inotify, as at the user's limit, unread bytes stay for the next host.
  const int events = ::inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
  if (events < 0) return;
  events_.assign(events);
  if (watch(IN_OPEN | IN_CLOSE)) wait_for_hosts();
}

bool PtyLink::watch(std::uint32_t events) {
  return ::inotify_add_watch(events_.native_handle(), terminal_name_.c_str(), events) >= 0;
}

void PtyLink::wait_for_hosts() {
  events_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                     [this](const boost::system::error_code& error) {
                       if (error) return;
                       handle_host_events();
                       wait_for_hosts();
                     });
}

/// Returns whether a host has the terminal open. A count of events would be wrong, as inotify
/// merges equal events. The master reports POLLHUP when no process has the terminal open, so this
/// process closes `terminal_` for a moment. The calls of `watch` hide this close and open from
/// inotify.
bool PtyLink::host_has_it_open() {
  int is_exclusive = 0;
  ::ioctl(terminal_.get(), TIOCGEXCL, &is_exclusive);
  ::ioctl(terminal_.get(), TIOCNXCL);  // an exclusive terminal could not be opened again
  watch(IN_OPEN);
  terminal_ = Descriptor();
  watch(IN_CLOSE);  // a host that closes it after this causes an event
  pollfd master{.fd = master_.get(), .events = 0, .revents = 0};
  ::poll(&master, 1, 0);
  const bool has_host = (master.revents & POLLHUP) == 0;
  terminal_ = Descriptor(::open(terminal_name_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  watch(IN_OPEN | IN_CLOSE);
  if (has_host && is_exclusive != 0) ::ioctl(terminal_.get(), TIOCEXCL);
  return has_host;
}

void PtyLink::handle_host_events() {
  if (!events_.is_open()) return;
  bool is_closed = false;
  bool is_closed_last = false;
  bool is_opened_as_first = false;
  std::array<char, 4096> events{};
  for (;;) {
    const ssize_t size = ::read(events_.native_handle(), events.data(), events.size());
    if (size <= 0) break;
    for (std::size_t at = 0; at < static_cast<std::size_t>(size);) {
      inotify_event event{};
      std::memcpy(&event, events.data() + at, sizeof event);
      at += sizeof event + event.len;
      if ((event.mask & IN_CLOSE) != 0) is_closed = is_closed_last = true;
      // An open after a close counts as a first one: most likely the host has restarted.
      if ((event.mask & IN_OPEN) == 0) continue;
      if (is_closed || !has_host_) is_opened_as_first = true;
      has_host_ = true;
      is_closed_last = false;
    }
  }
  // After an open as the last event, a host has the terminal open; its close will cause an event.
  if (is_closed_last) has_host_ = host_has_it_open();
  if (is_opened_as_first || (is_closed && !has_host_)) ::ioctl(terminal_.get(), TCFLSH, TCIFLUSH);
}

PtyLink::~PtyLink() {
  if (target_of(path_) == terminal_name_) ::unlink(path_.c_str());
}

}  // namespace lk::emulator
