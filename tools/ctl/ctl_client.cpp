#include "tools/ctl/ctl_client.hpp"

#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "emulator/core/start_error.hpp"
#include "emulator/files/runtime_dir.hpp"

namespace lk::emulator {
namespace {

/// Time-out for a stopped process: the kernel accepts connections for it, but it does not answer.
constexpr auto kPatience = std::chrono::seconds(2);

/// A minimal HTTP connection: one request, then the whole answer up to the end of the stream.
class Connection {
 public:
  Connection(const std::filesystem::path& path, std::chrono::seconds patience)
      : fd_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const std::string name = path.string();
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (name.size() >= sizeof address.sun_path) {
      ::close(fd_);
      throw StartError("ctl: " + name + " is longer than the path of a socket can be");
    }
    const timeval limit{patience.count(), 0};  // 0: no time-out
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    ::setsockopt(fd_, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
    std::copy(name.begin(), name.end(), std::begin(address.sun_path));
    if (::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      const int error = errno;
      ::close(fd_);
      throw StartError("ctl: no answer at " + name + ": " + std::generic_category().message(error));
    }
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() { ::close(fd_); }

  void send(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t sent = ::send(fd_, text.data(), text.size(), MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent < 0) return;  // no error: the server may answer without reading the whole request
      text.remove_prefix(static_cast<std::size_t>(sent));
    }
  }

  std::string receive_all() const {
    std::string all;
    char buffer[16384];
    for (;;) {
      const ssize_t size = ::recv(fd_, buffer, sizeof buffer, 0);
      if (size < 0 && errno == EINTR) continue;
      if (size <= 0) return all;
      all.append(buffer, static_cast<std::size_t>(size));
    }
  }

 private:
  int fd_;
};

CtlClient::Answer parse_answer(const std::string& text, const std::string& socket) {
  // "HTTP/1.1 200 OK"
  constexpr std::size_t kStatusAt = 9;
  const std::size_t head = text.find("\r\n\r\n");
  int status = 0;
  if (head != std::string::npos && text.starts_with("HTTP/1.1 ")) {
    std::from_chars(text.data() + kStatusAt, text.data() + head, status);
  }
  if (status == 0) throw StartError("ctl: " + socket + " gives no answer");
  try {
    return {status, Json::parse(std::string_view(text).substr(head + 4))};
  } catch (const Json::exception&) {
    throw StartError("ctl: " + socket + " does not answer as lk-emu does");
  }
}

std::vector<std::filesystem::path> trusted_sockets() {
  try {
    return live_sockets();
  } catch (const StartError& problem) {
    throw StartError(std::string("ctl: ") + problem.what() +
                     "; choose the socket with --socket PATH");
  }
}

}  // namespace

CtlClient::Answer CtlClient::ask(const std::string& method, const std::string& path,
                                 const Json& body, std::chrono::seconds patience) const {
  const Connection connection(socket_, patience);
  std::string request =
      method + " /api/v1" + path + " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n";
  if (body.is_null()) {
    request += "\r\n";
  } else {
    const std::string text = body.dump(-1, ' ', false, Json::error_handler_t::replace);
    request += "Content-Type: application/json\r\nContent-Length: " + std::to_string(text.size()) +
               "\r\n\r\n" + text;
  }
  connection.send(request);
  return parse_answer(connection.receive_all(), socket_.string());
}

std::filesystem::path find_socket(const std::string& socket, const std::string& bus) {
  if (!socket.empty()) return socket;
  std::vector<std::filesystem::path> live = trusted_sockets();
  if (live.empty()) {
    throw StartError("ctl: no lk-emu is running here (none in " + runtime_directory().string() +
                     "); choose the socket with --socket PATH");
  }
  if (!bus.empty()) {
    std::erase_if(live, [&](const std::filesystem::path& path) {
      try {
        const Json status = CtlClient(path).ask("GET", "/status", nullptr, kPatience).body;
        return std::ranges::none_of(status.value("buses", Json::array()),
                                    [&](const Json& one) { return one.value("bus", "") == bus; });
      } catch (const StartError& problem) {
        std::fprintf(stderr, "lk-emu: %s (skipped)\n", problem.what());
        return true;
      }
    });
    if (live.empty()) throw StartError("ctl: no running lk-emu has a bus " + bus);
  }
  if (live.size() > 1) {
    std::string names;
    for (const auto& path : live) names.append(" ").append(path.string());
    throw StartError("ctl: several are running; choose one by --bus or --socket:" + names);
  }
  return live.front();
}

}  // namespace lk::emulator
