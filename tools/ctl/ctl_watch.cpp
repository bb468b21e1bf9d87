#include "tools/ctl/ctl_watch.hpp"

#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <iterator>
#include <string>
#include <string_view>

#include "emulator/core/start_error.hpp"
#include "tools/ctl/ctl_tables.hpp"

namespace lk::emulator {
namespace {

/// Returns true for keys whose values are always text: ids=1, name=7.
bool is_text_key(std::string_view key) {
  constexpr std::string_view kText[] = {"ids", "bus", "name", "mark", "clear", "power"};
  return std::ranges::find(kText, key) != std::end(kText);
}

Json value_of(const std::string& key, const std::string& text) {
  if (is_text_key(key)) return text;
  if (text == "true") return true;
  if (text == "false") return false;
  if (text.starts_with('{') || text.starts_with('[')) {
    try {
      return parse_json(text);
    } catch (const JsonError& problem) {
      throw StartError("ctl: " + key + ": " + problem.what());
    }
  }
  const char* const last = text.data() + text.size();
  std::int64_t whole = 0;
  const auto [whole_end, whole_error] = std::from_chars(text.data(), last, whole);
  if (whole_error == std::errc() && whole_end == last) return whole;
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), last, number);
  if (error == std::errc() && end == last && std::isfinite(number)) return number;
  return text;
}

}  // namespace

void put_word(Json& object, const std::string& word) {
  const std::size_t equals = word.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw StartError("ctl: \"" + word + "\" is not KEY=VALUE, like supply_V=18");
  }
  Json* place = &object;
  std::string key = word.substr(0, equals);
  for (std::size_t dot = key.find('.'); dot != std::string::npos; dot = key.find('.')) {
    place = &(*place)[key.substr(0, dot)];
    if (!place->is_null() && !place->is_object()) {
      throw StartError("ctl: \"" + word + "\": " + key.substr(0, dot) + " has a value already");
    }
    key.erase(0, dot + 1);
  }
  if (place->contains(key)) throw StartError("ctl: " + word.substr(0, equals) + " is given twice");
  (*place)[key] = value_of(key, word.substr(equals + 1));
}

double parse_span_s(const std::string& text) {
  struct Unit {
    std::string_view word;
    double s;
  };
  constexpr Unit kUnits[] = {{"", 1},      {"s", 1},    {"ms", 1e-3},
                             {"us", 1e-6}, {"min", 60}, {"h", 3600}};
  double number = 0;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  if (error == std::errc() && number >= 0) {
    const std::string_view word(end, static_cast<std::size_t>(last - end));
    for (const Unit& unit : kUnits) {
      if (word == unit.word) return number * unit.s;
    }
  }
  throw StartError("ctl: \"" + text + "\" is not a time, like 10ms, 1.5s or 2min");
}

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
  const std::string first = page(client);  // may throw, hence before the screen is switched
  const Screen screen;
  screen.show(first);
  while (!screen.wait()) screen.show(page(client));
  return 0;
}

}  // namespace lk::emulator
