// The control interface over real sockets: who may come in, and clients that mean no good. No test
// waits for a time: what is waited for is an answer or the end of the connection.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "emulator/control/control_server.hpp"
#include "emulator/control/http_access.hpp"
#include "emulator/control/runtime_dir.hpp"
#include "emulator/program/cli.hpp"
#include "tests/emulator/control_support.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;

/// A client without a library to keep it from misbehaving.
class Client {
 public:
  static Client unix_socket(const fs::path& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string name = path.string();
    std::copy(name.begin(), name.end(), std::begin(address.sun_path));
    return {AF_UNIX, reinterpret_cast<const sockaddr*>(&address), sizeof address};
  }
  static Client tcp(unsigned port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return {AF_INET, reinterpret_cast<const sockaddr*>(&address), sizeof address};
  }
  Client(Client&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client() {
    if (fd_ >= 0) ::close(fd_);
  }

  void send(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t sent = ::send(fd_, text.data(), text.size(), MSG_NOSIGNAL);
      if (sent <= 0) return;
      text.remove_prefix(static_cast<std::size_t>(sent));
    }
  }
  /// Until `text` has come, or the end.
  std::string receive_until(const std::string& text) const {
    std::string all;
    char byte = 0;
    while (all.find(text) == std::string::npos && ::recv(fd_, &byte, 1, 0) > 0) all += byte;
    return all;
  }
  std::string receive_all() const { return receive_until(std::string(1, '\0')); }
  /// One answer, which has a Content-Length.
  std::string receive_answer() const {
    std::string head = receive_until("\r\n\r\n");
    const std::size_t at = head.find("Content-Length: ");
    std::size_t left = at == std::string::npos ? 0 : std::stoul(head.substr(at + 16));
    char byte = 0;
    for (; left > 0 && ::recv(fd_, &byte, 1, 0) > 0; --left) head += byte;
    return head;
  }

 private:
  Client(int family, const sockaddr* address, socklen_t size)
      : fd_(::socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    if (::connect(fd_, address, size) != 0) throw std::runtime_error("connect");
    const timeval patience{20, 0};  // a test that fails ends too
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }

  int fd_;
};

int status(const std::string& answer) {
  return answer.starts_with("HTTP/1.1 ") ? std::stoi(answer.substr(9, 3)) : 0;
}

/// A server whose loop runs on a thread of its own.
class Served : public testing::Test {
 protected:
  Served() {
    std::string name = testing::TempDir() + "lk-http-XXXXXX";
    directory_ = ::mkdtemp(name.data());
    options_.socket = (directory_ / "s").string();
  }
  ~Served() override {
    stop();
    fs::remove_all(directory_);
  }
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
    const fs::path file = directory_ / "token";
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

  fs::path directory_;
  ControlOptions options_;
  TestWorld t_;
  std::optional<ControlServer> server_;
  std::thread thread_;
};

const std::string kStatus = "GET /api/v1/status HTTP/1.1\r\nHost: x\r\n\r\n";

TEST_F(Served, AnswersAndStaysConnected) {
  start();
  const Client one = client();
  for (int n = 0; n < 3; ++n) {
    one.send(kStatus);
    EXPECT_EQ(status(one.receive_answer()), 200);
  }
}

TEST_F(Served, TheSocketIsOursAlone) {
  start();
  EXPECT_EQ(fs::status(options_.socket).permissions(),
            fs::perms::owner_read | fs::perms::owner_write);
  stop();
  EXPECT_FALSE(fs::exists(options_.socket)) << "removed at the end";
}

TEST_F(Served, ALiveSocketIsLeftAloneAndADeadOneReplaced) {
  start();
  EXPECT_THROW(ControlServer(t_.loop, t_.world, options_), StartError);
  EXPECT_EQ(status(ask(kStatus)), 200);
  stop();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(options_.socket.begin(), options_.socket.end(), std::begin(address.sun_path));
  const int dead = ::socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(::bind(dead, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ::close(dead);
  ASSERT_TRUE(fs::exists(options_.socket));
  EXPECT_NO_THROW(ControlServer(t_.loop, t_.world, options_));
}

TEST_F(Served, NothingElseIsReplaced) {
  std::ofstream(options_.socket) << "mine";
  EXPECT_THROW(ControlServer(t_.loop, t_.world, options_), StartError);
  EXPECT_EQ(fs::file_size(options_.socket), 4U);
  fs::remove(options_.socket);
  fs::create_symlink(directory_ / "elsewhere", options_.socket);
  EXPECT_THROW(ControlServer(t_.loop, t_.world, options_), StartError);
}

TEST_F(Served, ADirectoryThatOthersHaveAHandInIsRefused) {
  const fs::path directory = directory_ / "runtime";
  EXPECT_NO_THROW(secure_directory(directory));
  EXPECT_EQ(fs::status(directory).permissions(), fs::perms::owner_all);
  fs::permissions(directory, fs::perms::group_read, fs::perm_options::add);
  EXPECT_THROW(secure_directory(directory), StartError);
  fs::remove(directory);
  fs::create_directory(directory_ / "other");
  fs::permissions(directory_ / "other", fs::perms::owner_all);
  fs::create_directory_symlink(directory_ / "other", directory);
  EXPECT_THROW(secure_directory(directory), StartError);
}

TEST_F(Served, RequestsSentAheadAreAnsweredInOrder) {
  start();
  const Client one = client();
  std::string many;
  for (int n = 0; n < 200; ++n) many += kStatus;
  one.send(many);
  for (int n = 0; n < 200; ++n) ASSERT_EQ(status(one.receive_answer()), 200) << n;
  one.send("\x01\x02 garbage\r\n\r\n");
  EXPECT_EQ(status(one.receive_all()), 400);
}

TEST_F(Served, HeadersAndBodiesHaveAnEnd) {
  start();
  EXPECT_EQ(status(ask("GET /api/v1/status HTTP/1.1\r\nX: " + std::string(9000, 'x') + "\r\n\r\n")),
            431);
  const auto post = [](const std::string& path, std::size_t length) {
    return "POST /api/v1" + path + " HTTP/1.1\r\nContent-Type: application/json\r\n" +
           "Content-Length: " + std::to_string(length) + "\r\n\r\n";
  };
  EXPECT_EQ(status(ask(post("/directives", 64 * 1024 + 1))), 413);
  EXPECT_EQ(status(ask(post("/scenario", 1024 * 1024 + 1))), 413);
  EXPECT_EQ(status(ask(post("/scenario", 100'000) + std::string(100'000, ' '))), 501);
  // A body that never ends.
  const Client endless = client();
  endless.send("POST /api/v1/directives HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n");
  const std::string chunk = "4000\r\n" + std::string(0x4000, 'x') + "\r\n";
  for (int n = 0; n < 8; ++n) endless.send(chunk);
  EXPECT_EQ(status(endless.receive_all()), 413);
}

TEST_F(Served, ASlowClientKeepsNobodyWaiting) {
  start();
  std::vector<Client> slow;
  for (int n = 0; n < 20; ++n) {
    slow.push_back(client());
    slow.back().send("GET /api/v1/sta");
  }
  EXPECT_EQ(status(ask(kStatus)), 200);
}

TEST_F(Served, SoManyConnectionsAndNoMore) {
  start();
  std::vector<Client> many;
  for (int n = 0; n < kMostConnections; ++n) {
    many.push_back(client());
    many.back().send(kStatus);
    ASSERT_EQ(status(many.back().receive_answer()), 200) << n;
  }
  EXPECT_EQ(client().receive_all(), "") << "closed at once";
  many.front().send(kStatus);
  EXPECT_EQ(status(many.front().receive_answer()), 200) << "the others stay";
}

TEST_F(Served, AnAdvanceEndsWhenNobodyWaitsForIt) {
  start();
  {
    const Client one = client();
    const std::string body = R"({"by_s": 36000})";
    one.send(
        "POST /api/v1/clock/advance HTTP/1.1\r\nContent-Type: application/json\r\n"
        "Content-Length: " +
        std::to_string(body.size()) + "\r\n\r\n" + body);
    while (ask("GET /api/v1/clock HTTP/1.1\r\n\r\n").find("\"advancing\":true") ==
           std::string::npos) {
    }
  }
  while (ask("GET /api/v1/clock HTTP/1.1\r\n\r\n").find("\"advancing\":true") !=
         std::string::npos) {
  }
  EXPECT_NE(ask("GET /api/v1/clock HTTP/1.1\r\n\r\n").find("\"advancing\":false"),
            std::string::npos);
}

TEST_F(Served, OverTcpNoPageInABrowserGetsIn) {
  options_.http = HttpAddress{"127.0.0.1", 0};
  start();
  const auto with = [&](const std::string& name, const std::string& more) {
    return status(ask_tcp("GET /api/v1/status HTTP/1.1\r\nHost: " + name + "\r\n" + more + "\r\n"));
  };
  EXPECT_EQ(with(host(), ""), 200);
  EXPECT_EQ(with(host(), "Origin: http://" + host() + "\r\n"), 200);
  EXPECT_EQ(with(host(), "Origin: http://example.com\r\n"), 403);
  EXPECT_EQ(with(host(), "Origin: null\r\n"), 403);
  EXPECT_EQ(with("example.com:" + std::to_string(server_->port()), ""), 403);
  EXPECT_EQ(with("localhost", ""), 403) << "another port";
  EXPECT_EQ(with(host(),
                 "Origin: http://example.com\r\nConnection: Upgrade\r\n"
                 "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                 "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"),
            403);
}

TEST_F(Served, ATokenIsAskedForWhenThereIsOne) {
  const std::string token = "correct-horse-battery";
  options_.http = HttpAddress{"127.0.0.1", 0};
  options_.token_file = token_file(token, fs::perms::owner_read);
  start();
  const auto with = [&](const std::string& more) {
    return status(
        ask_tcp("GET /api/v1/status HTTP/1.1\r\nHost: " + host() + "\r\n" + more + "\r\n"));
  };
  EXPECT_EQ(with(""), 401);
  EXPECT_EQ(with("Authorization: Bearer " + token + "\r\n"), 200);
  EXPECT_EQ(with("Authorization: Bearer " + token + "x\r\n"), 401);
  EXPECT_EQ(with("Authorization: Bearer correct-horse-batterz\r\n"), 401);
  EXPECT_EQ(with("Authorization: Bearer \r\n"), 401);
  EXPECT_EQ(with("Authorization: Basic " + token + "\r\n"), 401);
}

TEST_F(Served, OthersGetInWithATokenOnly) {
  options_.http = HttpAddress{"0.0.0.0", 0};
  EXPECT_THROW(ControlServer(t_.loop, t_.world, options_), StartError);
  options_.token_file =
      token_file("long enough for a token", fs::perms::owner_read | fs::perms::others_read);
  EXPECT_THROW(ControlServer(t_.loop, t_.world, options_), StartError) << "others can read it";
  options_.token_file = token_file("short", fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_THROW(ControlServer(t_.loop, t_.world, options_), StartError);
  options_.http->address = "example.com";
  EXPECT_THROW(ControlServer(t_.loop, t_.world, options_), StartError) << "no address";
}

TEST_F(Served, TelemetryTellsEveryInstantOfSimulatedTime) {
  start();
  const Client stream = client();
  stream.send(
      "GET /api/v1/telemetry?signals=alive&ids=2&rate_Hz=1000 HTTP/1.1\r\nHost: x\r\n"
      "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
  EXPECT_EQ(status(stream.receive_until("\r\n\r\n")), 101);
  EXPECT_NE(stream.receive_until("}").find(R"({"bus":"vcan0","ids":[2],"signals":["alive"])"),
            std::string::npos);
  const std::string body = R"({"by_s": 0.003})";
  EXPECT_EQ(status(ask("POST /api/v1/clock/advance HTTP/1.1\r\nContent-Type: application/json\r\n"
                       "Content-Length: " +
                       std::to_string(body.size()) + "\r\n\r\n" + body)),
            200);
  // Frames are as small as their text: a length byte, then it. 1 ms apart, from where it began.
  for (const char* time : {"0", "0.001", "0.002", "0.003"}) {
    const std::string sample = stream.receive_until("}");
    EXPECT_NE(sample.find(std::string("{\"time_s\":") + time + ",\"rows\":[[2,"), std::string::npos)
        << sample;
  }
}

}  // namespace
}  // namespace lk::emulator
