// A client's bytes on a connection, HTTP and WebSocket frames after an upgrade, in one piece or
// several. Answers are HTTP up to an upgrade, without internal errors. After a disconnection all
// its memory is freed.
//
// Input: a byte of settings (bit 0: over TCP with a token and a known Host, bits 1..3: number of
// further pieces, bit 4: the client disconnects in the middle), then the bytes.

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/beast/http.hpp>
#include <cstddef>
#include <string>

#include "emulator/io/control/http_session.hpp"
#include "tests/emulator/control/control_support.hpp"
#include "tests/fuzz/support.hpp"

namespace lk::emulator {
namespace {

namespace http = boost::beast::http;
using fuzz::require;

std::shared_ptr<HttpEndpoint> endpoint_of(bool tcp) {
  auto endpoint = std::make_shared<HttpEndpoint>();
  if (tcp) endpoint->access = {true, "correct-horse-battery"};
  return endpoint;
}

class Connection {
 public:
  explicit Connection(bool tcp) : endpoint_(endpoint_of(tcp)) {
    int ends[2];
    require(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) == 0);
    client_ = ends[0];
    ::fcntl(client_, F_SETFL, O_NONBLOCK);
    boost::asio::local::stream_protocol::socket socket(
        t_.loop, boost::asio::local::stream_protocol(), ends[1]);
    serve_http(HttpSocket(std::move(socket)), shared_, endpoint_);
    settle();
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() {  // a throw here is a finding
    if (client_ >= 0) ::close(client_);
    settle();
    require(endpoint_->connections == 0 && endpoint_->idle.empty());
    require(shared_->telemetry_values == 0 && shared_->frame_streams == 0);
  }

  void send(std::string_view text) {
    sent_ += text;
    while (!text.empty()) {
      const ssize_t sent = ::send(client_, text.data(), text.size(), MSG_NOSIGNAL);
      settle();
      receive();
      if (sent <= 0) return;  // closed, or the server stopped reading
      text.remove_prefix(static_cast<std::size_t>(sent));
    }
    Line& line = *t_.world.lines().front();  // so that telemetry has samples
    line.advance_to(line.bus().time() + std::chrono::milliseconds(2), MonoTime::max(),
                    Line::WaitPolicy::kNone);
    settle();
  }
  void shut_down_writing() {
    ::shutdown(client_, SHUT_WR);
    settle();
    receive();
  }
  void hang_up() { ::close(std::exchange(client_, -1)); }

  /// Checks that all answers up to an upgrade are HTTP with valid JSON.
  void check_answers() {
    receive();
    const bool asked_for_heads = sent_.find("HEAD ") != std::string::npos;
    std::string_view rest = answers_;
    while (!rest.empty()) {
      const bool bodiless = asked_for_heads && ends_with_its_head(rest);
      http::response_parser<http::string_body> parser;
      parser.eager(true);
      parser.skip(bodiless);
      boost::system::error_code error;
      const std::size_t used =
          parser.put(boost::asio::const_buffer(rest.data(), rest.size()), error);
      require(!error && parser.is_header_done());
      const unsigned status = parser.get().result_int();
      require(status != 500);
      if (status == 101) return;
      require(parser.is_done() && used > 0);
      const bool json = parser.get()[http::field::content_type] == "application/json";
      require(json || status < 300 || status == 304);
      require(!json || bodiless ||
              !Json::parse(parser.get().body(), nullptr, false).is_discarded());
      rest.remove_prefix(used);
    }
  }

 private:
  /// An answer to HEAD has the length of an absent body. No body here begins like an answer.
  static bool ends_with_its_head(std::string_view answers) {
    constexpr std::string_view kEnd = "\r\n\r\n";
    const std::size_t end = answers.find(kEnd);
    if (end == std::string_view::npos) return false;
    const std::string_view next = answers.substr(end + kEnd.size());
    return next.empty() || next.starts_with("HTTP/1.1 ");
  }
  void settle() {
    t_.loop.restart();
    while (t_.loop.poll_one() > 0) {
      if (t_.world.advancing()) shared_->api.abandon();  // skips advances of days
      // A running clock always lags here, so the loop would never become idle.
      if (!t_.world.clock().mode().stepped) t_.world.set_clock({.stepped = true});
    }
  }
  void receive() {
    char bytes[4096];
    ssize_t size = 0;
    while ((size = ::recv(client_, bytes, sizeof bytes, 0)) > 0) {
      answers_.append(bytes, static_cast<std::size_t>(size));
      settle();
    }
  }

  TestWorld t_;
  std::shared_ptr<HttpShared> shared_ = std::make_shared<HttpShared>(t_.world);
  std::shared_ptr<HttpEndpoint> endpoint_;
  int client_ = -1;
  std::string sent_;
  std::string answers_;
};

void check(std::uint8_t settings, std::string_view text) {
  spdlog::set_level(spdlog::level::off);
  Connection connection((settings & 1U) != 0);
  const std::size_t pieces = 1 + (settings >> 1U & 7U);
  const std::size_t length = text.size() / pieces + 1;
  for (; !text.empty(); text.remove_prefix(std::min(length, text.size()))) {
    connection.send(text.substr(0, length));
  }
  if ((settings & 16U) != 0) {
    connection.hang_up();
    return;
  }
  connection.shut_down_writing();
  connection.check_answers();
}

}  // namespace
}  // namespace lk::emulator

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 0) {
    lk::emulator::check(data[0], {reinterpret_cast<const char*>(data + 1), size - 1});
  }
  return 0;
}
