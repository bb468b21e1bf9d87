#pragma once

/// @file The control interface over real sockets, and clients that no library keeps from
/// misbehaving.

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

#include "emulator/control/control_server.hpp"
#include "tests/emulator/control/control_support.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/temp_directory.hpp"

namespace lk::emulator {

namespace fs = std::filesystem;

/// As long as it lives, this process cannot open anything; what is open stays so.
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

/// A client without a library to keep it from misbehaving. What does not happen within its patience
/// is a failure, and never taken for a closed connection.
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
  /// Not connected yet.
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

  /// Returns whether all has gone out; else the other end has closed.
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
  /// Until `text` has come, or the end.
  std::string receive_until(const std::string& text) const {
    std::string all;
    while (!all.ends_with(text) && receive_byte(all, text)) {
    }
    return all;
  }
  /// Until the end.
  std::string receive_all() const {
    std::string all;
    while (receive_byte(all, "the end of the connection")) {
    }
    return all;
  }
  /// One answer, which has a Content-Length.
  std::string receive_answer() const {
    std::string head = receive_until("\r\n\r\n");
    const std::size_t at = head.find("Content-Length: ");
    std::size_t left = at == std::string::npos ? 0 : std::stoul(head.substr(at + 16));
    while (left > 0 && receive_byte(head, "the rest of the body")) --left;
    return head;
  }
  /// Whether something has come, or the end, before so much time is over.
  bool hears_within(std::chrono::milliseconds time) const {
    pollfd readable{fd_, POLLIN, 0};
    return ::poll(&readable, 1, static_cast<int>(time.count())) > 0;
  }

 private:
  void connect_to(const sockaddr* address, socklen_t size) const {
    if (::connect(fd_, address, size) != 0) throw std::runtime_error("connect");
  }
  /// Appends the next byte; false at the end of the connection.
  bool receive_byte(std::string& to, const std::string& awaited) const {
    char byte = 0;
    const ssize_t size = ::recv(fd_, &byte, 1, 0);
    if (size < 0) expect_closed(awaited);
    if (size > 0) to += byte;
    return size > 0;
  }
  /// After a call that failed: because the other end has closed, and not because time was over.
  static void expect_closed(const std::string& awaited) {
    const int error = errno;
    if (error == EPIPE || error == ECONNRESET) return;
    ADD_FAILURE() << "waited, " << kPatience_s << " s at most, for "
                  << testing::PrintToString(awaited) << ": " << std::strerror(error);
  }

  // A machine may be busy, and sanitizers slow.
  static constexpr int kPatience_s = 60;
  int fd_;
};

inline int status(const std::string& answer) {
  return answer.starts_with("HTTP/1.1 ") ? std::stoi(answer.substr(9, 3)) : 0;
}

/// A server whose loop runs on a thread of its own.
class Served : public testing::Test {
 protected:
  Served() { options_.socket = own_.path("s"); }
  explicit Served(const BusConfig& only) : t_(only) { options_.socket = own_.path("s"); }
  ~Served() override { stop(); }
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
  /// A token file with that mode.
  fs::path token_file(const std::string& token, fs::perms mode) const {
    fs::path file = directory_ / "token";
    fs::remove(file);  // an ordinary user cannot write a file without the permission
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
  std::string host() const { return "localhost:" + std::to_string(server_->port()); }

  const test::TempDirectory own_;
  const fs::path& directory_ = own_.path();
  ControlOptions options_;
  TestWorld t_;
  std::optional<ControlServer> server_;
  std::thread thread_;
};

inline const std::string kStatus = "GET /api/v1/status HTTP/1.1\r\nHost: x\r\n\r\n";

/// A POST with a body of JSON.
inline std::string post(const std::string& path, const std::string& body) {
  return "POST /api/v1" + path + " HTTP/1.1\r\nContent-Type: application/json\r\n" +
         "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
}

/// What asks for telemetry; frames may follow it.
inline std::string upgrade(const std::string& query) {
  return "GET /api/v1/telemetry?" + query +
         " HTTP/1.1\r\nHost: x\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
         "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
}

}  // namespace lk::emulator
