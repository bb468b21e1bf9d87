// Round trips over the byte protocols of docs/guides/buses.md. `clients ask KIND PORT` queries
// drive 1 and prints reply times and replies per second. `clients echo KIND PORT` is the reference:
// a server that answers each query at once with bytes of equal length. bench/transports runs both.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace {

struct Protocol {
  std::string_view name;
  std::string_view begin;     // first bytes of the host
  std::string_view begun;     // reply to them
  std::string_view query;     // read state 1, of drive 1
  char end;                   // of a query
  std::string_view answer;    // as long as a drive's
  std::string_view answered;  // prefix of an answer
  char last;                  // last byte of an answer
};
constexpr Protocol kProtocols[] = {
    {"slcan", "O\r", "\r", "t14189A00000000000000\r", '\r', "z\rt14189A1900F000000000\r", "t141",
     '\r'},
    {"socketcand", "< open can0 >< rawmode >", "< hi >< ok >< ok >",
     "< send 141 8 9A 0 0 0 0 0 0 0 >", '>', "< frame 141 1700000000.000000 9A1900F000000000 >",
     "< frame 141", '>'},
};

[[noreturn]] void fail(const char* what) {
  std::perror(what);
  std::exit(1);
}

int connected(const sockaddr_in& address) {
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
  const int now = 1;
  ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &now, sizeof now);
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    fail("connect");
  }
  return fd;
}

void say(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t size = ::write(fd, text.data(), text.size());
    if (size <= 0) fail("write");
    text.remove_prefix(static_cast<std::size_t>(size));
  }
}

std::string hear(int fd) {
  char bytes[65536];
  const ssize_t size = ::read(fd, bytes, sizeof bytes);
  if (size <= 0) fail("read");
  return {bytes, static_cast<std::size_t>(size)};
}

/// Counts complete answers and removes them; an incomplete rest stays in `text`.
std::size_t take_answers(const Protocol& protocol, std::string& text) {
  std::size_t count = 0;
  std::size_t done = 0;
  for (;;) {
    const std::size_t begin = text.find(protocol.answered, done);
    const std::size_t end = begin == std::string::npos ? begin : text.find(protocol.last, begin);
    if (end == std::string::npos) break;
    ++count;
    done = end + 1;
  }
  text.erase(0, done);
  return count;
}

void ask(const Protocol& protocol, int fd) {
  using Clock = std::chrono::steady_clock;
  say(fd, protocol.begin);
  for (std::size_t heard = 0; heard < protocol.begun.size();) heard += hear(fd).size();
  constexpr int kOneByOne = 20'000;
  constexpr std::size_t kInAll = 64'000;
  constexpr std::size_t kAtOnce = 64;
  std::vector<double> us;
  std::string text;
  for (int n = 0; n < kOneByOne; ++n) {
    const auto begin = Clock::now();
    say(fd, protocol.query);
    while (take_answers(protocol, text) == 0) text += hear(fd);
    us.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
  }
  std::ranges::nth_element(us, us.begin() + kOneByOne / 2);
  std::string many;
  for (std::size_t n = 0; n < kAtOnce; ++n) many += protocol.query;
  const auto begin = Clock::now();
  for (std::size_t asked = 0; asked < kInAll; asked += kAtOnce) {
    say(fd, many);
    for (std::size_t answered = 0; answered < kAtOnce; answered += take_answers(protocol, text)) {
      text += hear(fd);
    }
  }
  const double s = std::chrono::duration<double>(Clock::now() - begin).count();
  std::printf("%.1f %.0f\n", us[kOneByOne / 2], static_cast<double>(kInAll) / s);
}

void echo(const Protocol& protocol, const sockaddr_in& address) {
  const int server = ::socket(AF_INET, SOCK_STREAM, 0);
  const int now = 1;
  ::setsockopt(server, SOL_SOCKET, SO_REUSEADDR, &now, sizeof now);
  if (::bind(server, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(server, 1) != 0) {
    fail("listen");
  }
  std::puts("ready");
  std::fflush(stdout);
  const int fd = ::accept(server, nullptr, nullptr);
  ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &now, sizeof now);
  hear(fd);  // the opening bytes, which come at once
  say(fd, protocol.begun);
  char bytes[65536];
  for (;;) {
    const ssize_t size = ::read(fd, bytes, sizeof bytes);
    if (size <= 0) return;
    std::string answers;
    for (ssize_t n = 0; n < size; ++n) {
      if (bytes[n] == protocol.end) answers += protocol.answer;
    }
    say(fd, answers);
  }
}

}  // namespace

int main(int argc, char** argv) {
  for (const Protocol& protocol : kProtocols) {
    if (argc != 4 || protocol.name != argv[2]) continue;
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(std::atoi(argv[3])));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (std::string_view(argv[1]) == "echo") {
      echo(protocol, address);
    } else {
      ask(protocol, connected(address));
    }
    return 0;
  }
  std::fputs("usage: clients ask|echo slcan|socketcand PORT\n", stderr);
  return 2;
}
