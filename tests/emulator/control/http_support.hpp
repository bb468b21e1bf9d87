#pragma once

/// @file The control interface over real sockets, with raw clients that can misbehave.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <utility>

#include "emulator/io/control/control_server.hpp"
#include "tests/emulator/control/control_support.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::emulator {

namespace fs = std::filesystem;

/// While it exists, this process cannot open descriptors; open ones stay open.
class NoDescriptors {
 public:
  NoDescriptors() {
    EXPECT_EQ(::getrlimit(RLIMIT_NOFILE, &before_), 0);
    const rlimit none{0, before_.rlim_max};
    EXPECT_EQ(::setrlimit(RLIMIT_NOFILE, &none), 0);
  }
  NoDescriptors(const NoDescriptors&) = delete;
  NoDescriptors& operator=(const NoDescriptors&) = delete;
  ~NoDescriptors() { ::setrlimit(RLIMIT_NOFILE, &before_); }

 private:
  rlimit before_{};
};

/// A raw socket client. A time-out is a test failure, and never counts as a closed connection.
class Client {
 public:
  static Client unix_socket(const fs::path& path) {
    Client client(AF_UNIX);
    client.connect_to(path);
    return client;
  }
  static Client tcp(unsigned port, const char* address = "127.0.0.1") {
    Client client(AF_INET);
    client.connect_to(port, address);
    return client;
  }
  /// Creates an unconnected socket.
  explicit Client(int family) : fd_(::socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const timeval patience{kPatience_s, 0};
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    ::setsockopt(fd_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  }
  Client(Client&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Client& operator=(Client&&) = delete;
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client() {
    if (fd_ >= 0) ::close(fd_);
  }

  void connect_to(const fs::path& path) const {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string name = path.string();
    std::copy(name.begin(), name.end(), std::begin(address.sun_path));
    connect_to(reinterpret_cast<const sockaddr*>(&address), sizeof address);
  }
  void connect_to(unsigned port, const char* to = "127.0.0.1") const {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    ::inet_pton(AF_INET, to, &address.sin_addr);
    connect_to(reinterpret_cast<const sockaddr*>(&address), sizeof address);
  }

  /// Returns whether all was sent; false if the other end has closed.
  bool send(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t sent = ::send(fd_, text.data(), text.size(), MSG_NOSIGNAL);
      if (sent <= 0) {
        expect_closed("the other end to read, or to close");
        return false;
      }
      text.remove_prefix(static_cast<std::size_t>(sent));
    }
    return true;
  }
  /// Receives until `text` or the end of the connection.
  std::string receive_until(const std::string& text) const {
    std::string all;
    while (!all.ends_with(text) && receive_byte(all, text)) {
    }
    return all;
  }
  /// Receives until the end of the connection.
  std::string receive_all() const {
    std::string all;
    while (receive_byte(all, "the end of the connection")) {
    }
    return all;
  }
  /// Receives one answer with a Content-Length.
  std::string receive_answer() const {
    std::string head = receive_until("\r\n\r\n");
    const std::size_t at = head.find("Content-Length: ");
    std::size_t left = at == std::string::npos ? 0 : std::stoul(head.substr(at + 16));
    while (left > 0 && receive_byte(head, "the rest of the body")) --left;
    return head;
  }
  /// Returns whether data or the end arrives within `time`.
  bool receives_within(std::chrono::milliseconds time) const {
    pollfd readable{fd_, POLLIN, 0};
    return ::poll(&readable, 1, static_cast<int>(time.count())) > 0;
  }

 private:
  void connect_to(const sockaddr* address, socklen_t size) const {
    if (::connect(fd_, address, size) != 0) throw std::runtime_error("connect");
  }
  /// Appends the next byte; returns false at the end of the connection.
  bool receive_byte(std::string& to, const std::string& awaited) const {
    char byte = 0;
    const ssize_t size = ::recv(fd_, &byte, 1, 0);
    if (size < 0) expect_closed(awaited);
    if (size > 0) to += byte;
    return size > 0;
  }
  /// Call after a failed call: checks that the other end has closed, not that time has run out.
  static void expect_closed(const std::string& awaited) {
    const int error = errno;
    if (error == EPIPE || error == ECONNRESET) return;
    ADD_FAILURE() << "waited, " << kPatience_s << " s at most, for "
                  << testing::PrintToString(awaited) << ": " << std::strerror(error);
  }

  // Assumed: enough for a busy machine and slow sanitizers.
  static constexpr int kPatience_s = 60;
  int fd_;
};

inline int status(const std::string& answer) {
  return answer.starts_with("HTTP/1.1 ") ? std::stoi(answer.substr(9, 3)) : 0;
}

/// A server whose loop runs on its own thread.
class HttpServer : public testing::Test {
 protected:
  HttpServer() { options_.socket = own_.path("s"); }
  explicit HttpServer(const BusConfig& only) : t_(only) { options_.socket = own_.path("s"); }
  ~HttpServer() override { stop(); }
  void start() {
    server_.emplace(t_.loop, t_.world, options_);
    thread_ = std::thread([this] { t_.loop.run(); });
  }
  void stop() {
    if (!thread_.joinable()) return;
    t_.loop.stop();
    thread_.join();
    server_.reset();
  }
  /// Writes a token file with that mode.
  fs::path token_file(const std::string& token, fs::perms mode) const {
    fs::path file = directory_ / "token";
    fs::remove(file);  // a user without write permission cannot overwrite it
    std::ofstream(file) << token << '\n';
    fs::permissions(file, mode);
    return file;
  }
  Client client() const { return Client::unix_socket(options_.socket); }
  std::string ask(const std::string& text) const {
    const Client one = client();
    one.send(text);
    return one.receive_answer();
  }
  std::string ask_tcp(const std::string& text) const {
    const Client one = Client::tcp(server_->port());
    one.send(text);
    return one.receive_answer();
  }
  /// Asks over TCP, with more headers; returns the status.
  int get_tcp(const std::string& more, const std::string& path = "/status") const {
    return status(ask_tcp("GET /api/v1" + path + " HTTP/1.1\r\n" + more + "\r\n"));
  }
  int send_tcp(const std::string& line, const std::string& body,
               const std::string& more = "") const {
    return status(ask_tcp(line + " HTTP/1.1\r\nHost: " + host() + "\r\n" + more +
                          "Content-Type: application/json\r\nContent-Length: " +
                          std::to_string(body.size()) + "\r\n\r\n" + body));
  }
  /// Opens a stream; returns its client after the answer of this status.
  Client open(const std::string& request, int expected = 101) const {
    Client one = client();
    one.send(request);
    EXPECT_EQ(status(one.receive_until("\r\n\r\n")), expected);
    return one;
  }
  void stop_and_reset() {
    stop();
    t_.loop.restart();
  }
  std::string host() const { return "localhost:" + std::to_string(server_->port()); }

  const test::TempDirectory own_;
  const fs::path& directory_ = own_.path();
  ControlOptions options_;
  TestWorld t_;
  std::optional<ControlServer> server_;
  std::thread thread_;
};

inline const std::string kStatus = "GET /api/v1/status HTTP/1.1\r\nHost: x\r\n\r\n";

/// Returns a POST request with a JSON body.
inline std::string post(const std::string& path, const std::string& body) {
  return "POST /api/v1" + path + " HTTP/1.1\r\nContent-Type: application/json\r\n" +
         "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
}

/// Returns a WebSocket upgrade, with more headers.
inline std::string upgrade_at(const std::string& path, const std::string& more = "Host: x\r\n") {
  return "GET /api/v1" + path + " HTTP/1.1\r\n" + more +
         "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
}
/// Returns one for telemetry.
inline std::string upgrade(const std::string& query) { return upgrade_at("/telemetry?" + query); }

}  // namespace lk::emulator
