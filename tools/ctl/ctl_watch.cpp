#include "tools/ctl/ctl_watch.hpp"

#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <string>

#include "tools/ctl/ctl_tables.hpp"

namespace lk::emulator {
namespace {

constexpr int kPeriod_ms = 200;

volatile std::sig_atomic_t g_asked_to_stop = 0;

extern "C" void ask_to_stop(int /*signal*/) { g_asked_to_stop = 1; }

/// Puts the terminal into full-screen mode, and restores it afterwards.
class Screen {
 public:
  Screen() : has_keys_(::tcgetattr(STDIN_FILENO, &before_) == 0) {
    struct sigaction action {};
    action.sa_handler = ask_to_stop;
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) ::sigaction(signal, &action, nullptr);
    if (has_keys_) {
      termios raw = before_;
      raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
      ::tcsetattr(STDIN_FILENO, TCSANOW, &raw);
    }
    print("\x1b[?1049h\x1b[?25l");  // alternate screen, no cursor
  }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  ~Screen() {
    print("\x1b[?25h\x1b[?1049l");
    if (has_keys_) ::tcsetattr(STDIN_FILENO, TCSANOW, &before_);
  }

  /// Shows as much of `text` as fits.
  void show(const std::string& text) const {
    winsize size{};
    if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row == 0 || size.ws_col == 0) {
      size.ws_row = 24;
      size.ws_col = 80;
    }
    std::string screen = "\x1b[H";
    std::size_t begin = 0;
    for (unsigned row = 0; row < size.ws_row && begin < text.size(); ++row) {
      const std::size_t end = std::min(text.find('\n', begin), text.size());
      screen += (row > 0 ? "\r\n" : "") +
                text.substr(begin, std::min<std::size_t>(end - begin, size.ws_col));
      screen += "\x1b[K";
      begin = end + 1;
    }
    print(screen + "\x1b[J");
  }

  /// Waits for one period. Returns true if the user wants to quit.
  bool wait() const {
    pollfd keys{has_keys_ ? STDIN_FILENO : -1, POLLIN, 0};
    if (::poll(&keys, 1, kPeriod_ms) <= 0) return g_asked_to_stop != 0;
    char key = 0;
    return ::read(STDIN_FILENO, &key, 1) <= 0 || key == 'q' || g_asked_to_stop != 0;
  }

 private:
  static void print(const std::string& text) {
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
  }

  termios before_{};
  bool has_keys_;
};

std::string page(const CtlClient& client) {
  const Json clock = client.ask("GET", "/clock").body;
  char line[96];
  std::snprintf(line, sizeof line, "%s, %.3f s - q leaves\n\n",
                clock.value("mode", std::string()).c_str(), clock.value("time_s", 0.0));
  return line + drives_table(client.ask("GET", "/drives").body);
}

}  // namespace

int watch_drives(const CtlClient& client) {
  if (::isatty(STDOUT_FILENO) == 0) {
    std::fputs(drives_table(client.ask("GET", "/drives").body).c_str(), stdout);
    return 0;
  }
  const std::string first = page(client);  // before switching the screen, because it may fail
  const Screen screen;
  screen.show(first);
  while (!screen.wait()) screen.show(page(client));
  return 0;
}

}  // namespace lk::emulator
