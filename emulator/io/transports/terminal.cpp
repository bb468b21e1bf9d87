#include "emulator/io/transports/terminal.hpp"

#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <sys/ioctl.h>

#include <cerrno>
#include <system_error>

namespace lk::emulator {
namespace {

termios2 settings_of(int fd) {
  termios2 settings{};
  if (::ioctl(fd, TCGETS2, &settings) < 0) {
    throw std::system_error(errno, std::generic_category(), "TCGETS2");
  }
  return settings;
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

}  // namespace lk::emulator
