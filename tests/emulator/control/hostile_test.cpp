// Malicious clients of the control interface are refused, bounded and logged once, without effect
// on others. No test waits for a fixed time.

#include <boost/asio/post.hpp>
#include <future>
#include <sstream>
#include <vector>

#include "tests/emulator/control/http_support.hpp"
#include "tests/support/log.hpp"

namespace lk::emulator {
namespace hostile_test {

using namespace std::string_literals;

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; ++at) ++found;
  return found;
}

/// A frame as a client sends it, masked with zeros.
std::string websocket_frame(unsigned char first, const std::string& payload) {
  std::string frame(1, static_cast<char>(first));
  if (payload.size() < 126) {
    frame += static_cast<char>(0x80U | payload.size());
  } else {
    frame += {static_cast<char>(0xFE), static_cast<char>(payload.size() >> 8U),
              static_cast<char>(payload.size())};
  }
  return frame + std::string(4, '\0') + payload;
}

class Hostile : public HttpServer {
 protected:
  Client tcp() const { return Client::tcp(server_->port()); }
  /// Checks that a well-behaved client is served.
  void expect_others_served() const {
    EXPECT_EQ(status(ask(kStatus)), 200);
    if (server_->port() != 0) {
      EXPECT_EQ(get_tcp("Host: " + host() + "\r\n"), 200);
    }
  }
  /// Waits until the server has handled all earlier input: it polls its sockets between two posted
  /// handlers.
  void run_server_once() {
    for (int n = 0; n < 3; ++n) {
      const auto looked = std::make_shared<std::promise<void>>();
      boost::asio::post(t_.loop, [looked] { looked->set_value(); });
      looked->get_future().wait();
    }
  }
  void listen_to_tcp() { options_.http = HttpAddress{"127.0.0.1", 0}; }
};

// --- crowds

TEST_F(Hostile, FullTcpLeavesTheUnixSocketFree) {
  listen_to_tcp();
  start();
  std::vector<Client> crowd;
  for (int n = 0; n < kMaxConnections; ++n) {
    crowd.push_back(tcp());
    crowd.back().send("GET /api/v1/status HTTP/1.1\r\nHost: " + host() + "\r\n");
  }
  EXPECT_EQ(tcp().receive_all(), "") << "all are busy, so that it is closed at once";
  EXPECT_EQ(status(ask(kStatus)), 200);
  crowd.back().send("\r\n");
  EXPECT_EQ(status(crowd.back().receive_answer()), 200) << "those who were there stay";
}

TEST_F(Hostile, NewConnectionReplacesTheIdlest) {
  start();
  std::vector<Client> idle;
  for (int n = 0; n < kMaxConnections; ++n) {
    idle.push_back(client());
    idle.back().send(kStatus);
    ASSERT_EQ(status(idle.back().receive_answer()), 200) << n;
  }
  EXPECT_EQ(status(ask(kStatus)), 200);
  EXPECT_EQ(idle[0].receive_all(), "");
  idle[1].send(kStatus);
  EXPECT_EQ(status(idle[1].receive_answer()), 200);
}

TEST_F(Hostile, ServesAfterThousandsOfConnections) {
  listen_to_tcp();
  start();
  for (int n = 0; n < 1000; ++n) client();
  for (int n = 0; n < 1000; ++n) tcp();
  std::vector<Client> many;
  for (int n = 0; n < 200; ++n) many.push_back(n % 2 == 0 ? client() : tcp());
  expect_others_served();
}

TEST_F(Hostile, AcceptWaitsForFreeDescriptors) {
  if (kAddressSanitizer) GTEST_SKIP() << "the sanitizer needs descriptors of its own";
  listen_to_tcp();
  start();
  const Client first(AF_UNIX);
  const Client second(AF_INET);
  {
    const NoDescriptors none;
    first.connect_to(fs::path(options_.socket));
    run_server_once();
    second.connect_to(server_->port());
    run_server_once();
  }
  for (const Client* one : {&first, &second}) {
    one->send("GET /api/v1/status HTTP/1.1\r\nHost: " + host() + "\r\n\r\n");
    EXPECT_EQ(status(one->receive_answer()), 200);
  }
}

// --- time-outs

/// One deadline covers the whole request, even if bytes keep arriving.
TEST_F(Hostile, ClosesSlowRequestsDespiteProgress) {
  options_.timeouts.request = std::chrono::milliseconds(250);
  start();
  // With a deadline for each byte, both would end after 8000 bytes, with an answer.
  for (const std::string& begun :
       {"GET /api/v1/status HTTP/1.1\r\nX: "s,
        "POST /api/v1/directives HTTP/1.1\r\nContent-Type: application/json\r\n"
        "Content-Length: 8000\r\n\r\n"s}) {
    const Client one = client();
    one.send(begun);
    while (!one.receives_within(std::chrono::milliseconds(5)) && one.send("x")) {
    }
    EXPECT_EQ(one.receive_all(), "") << begun;
  }
}

TEST_F(Hostile, ClosesIdleConnections) {
  options_.timeouts.idle = std::chrono::milliseconds(1);
  start();
  EXPECT_EQ(client().receive_all(), "");
}

// --- requests

TEST_F(Hostile, RejectsPathTraversal) {
  start();
  for (const char* path :
       {"/../../etc/passwd", "/api/v1/../../etc/passwd", "/api/v1/%2e%2e/%2e%2e/etc/passwd",
        "/api/v1/drives/../status", "/api/v1/drives/%2e%2e/1", "/api/v1/status%00",
        "//api/v1/status", "/api/v1/drives/vcan0/1/", "http://x/api/../status", "*",
        "/api/v1/drives/vcan0/%31"}) {
    const std::string answer = ask(std::string("GET ") + path + " HTTP/1.1\r\nHost: x\r\n\r\n");
    EXPECT_EQ(status(answer), 404) << path;
  }
}

TEST_F(Hostile, LimitsChunksAndTrailers) {
  start();
  const std::string head =
      "POST /api/v1/directives HTTP/1.1\r\nContent-Type: application/json\r\n"
      "Transfer-Encoding: chunked\r\n\r\n";
  const std::string many(1'000'000, 'x');
  for (const std::string& endless :
       {"1;" + many, "1\r\nx\r\n0\r\nX: " + many, "ffffffffffffffff\r\n" + many, many}) {
    const Client one = client();
    one.send(head + endless);
    const int answer = status(one.receive_all());
    EXPECT_TRUE(answer == 400 || answer == 413 || answer == 431) << answer;
  }
  expect_others_served();
}

TEST_F(Hostile, AnswersHeadWithoutABody) {
  start();
  const Client one = client();
  one.send("HEAD /api/v1/status HTTP/1.1\r\nHost: x\r\n\r\n" + kStatus);
  const std::string head = one.receive_until("\r\n\r\n");
  EXPECT_EQ(status(head), 200);
  EXPECT_NE(head.find("Content-Length: "), std::string::npos);
  EXPECT_EQ(status(one.receive_answer()), 200) << "the next answer follows at once";
  one.send("HEAD / HTTP/1.1\r\nHost: x\r\n\r\nHEAD /api/v1/recording HTTP/1.1\r\nHost: x\r\n\r\n" +
           kStatus);
  EXPECT_EQ(status(one.receive_until("\r\n\r\n")), 200) << "the dashboard";
  EXPECT_EQ(status(one.receive_until("\r\n\r\n")), 405);
  EXPECT_EQ(status(one.receive_answer()), 200);
}

/// A proxy and this program could each use a different one.
TEST_F(Hostile, RejectsDuplicateSecurityHeaders) {
  listen_to_tcp();
  start();
  for (const std::string& twice :
       {"Host: " + host() + "\r\nHost: evil.example\r\n",
        "Host: " + host() + "\r\nOrigin: http://" + host() + "\r\nOrigin: http://evil.example\r\n",
        "Host: " + host() + "\r\nAuthorization: Bearer a\r\nAuthorization: Bearer b\r\n"}) {
    EXPECT_EQ(get_tcp(twice), 400) << twice;
  }
}

TEST_F(Hostile, SkipsRequestsOfClosedConnections) {
  listen_to_tcp();
  server_.emplace(t_.loop, t_.world, options_);
  int computed = 0;
  server_->api().recording.state = [&computed] { return Json(++computed); };
  for (int n = 0; n < 50; ++n) {
    tcp().send("GET /api/v1/status HTTP/1.1\r\nHost: " + host() + "\r\n\r\n");
    client().send(kStatus);
  }
  const Client last = client();
  last.send(kStatus);
  thread_ = std::thread([this] { t_.loop.run(); });
  EXPECT_EQ(status(last.receive_answer()), 200);
  EXPECT_EQ(get_tcp("Host: " + host() + "\r\n"), 200);
  EXPECT_EQ(computed, 2);
}

TEST_F(Hostile, WebSocketsLeaveFreeConnections) {
  start();
  std::vector<Client> streams;
  for (int n = 0; n < kMaxStreams; ++n) {
    streams.push_back(open(upgrade("signals=speed_dps&ids=1&rate_Hz=1")));
  }
  EXPECT_EQ(status(ask(upgrade("signals=speed_dps&ids=1&rate_Hz=1"))), 429);
  std::vector<Client> busy;
  for (int n = kMaxStreams; n < kMaxConnections - 2; ++n) {
    busy.push_back(client());
    busy.back().send("GET /api/v1/status HTTP/1.1\r\n");
  }
  EXPECT_EQ(status(ask(kStatus)), 200);
  streams.clear();
  run_server_once();
  EXPECT_EQ(status(ask(kStatus)), 200);
}

// --- log

TEST_F(Hostile, LogsEachKindOfRefusalOnce) {
  const test::Log log;
  listen_to_tcp();
  options_.token_file = token_file("correct-horse-battery", fs::perms::owner_read);
  start();
  const auto from = [&](const std::string& origin) {
    return "Host: " + host() + "\r\nOrigin: http://" + origin +
           "\r\nAuthorization: Bearer correct-horse-battery\r\n";
  };
  for (int n = 0; n < 50; ++n) {
    const std::string own = std::to_string(n);
    ask_tcp("GET /api/v1/status HTTP/1.1\r\nHost: " + host() + "\r\n\r\n");
    ask_tcp("GET /api/v1/status HTTP/1.1\r\nHost: evil" + own + "\r\n\r\n");
    ask_tcp("GET /api/v1/status HTTP/1.1\r\n" + from("evil" + own) + "\r\n");
    ask_tcp("DELETE /api/v1/faults HTTP/1.1\r\n" + from(host()) + "\r\n");
    ask_tcp("nonsense\r\n\r\n");
    ask(post("/directives", std::string(static_cast<std::size_t>(60'000 + n), '[')));
    ask(post("/directives", std::string(70'000, '[')));
    ask("GET /../etc/" + own + " HTTP/1.1\r\n\r\n");
    ask("GET /api/v1/advice?k" + own + "=1 HTTP/1.1\r\n\r\n");
    ask("GET /api/v1/drives/" + own + "/1 HTTP/1.1\r\n\r\n");
    ask("PUT / HTTP/1.1\r\n\r\n");
  }
  stop();
  const char* const kinds[] = {"401 Authorization: ",
                               "403 Host: ",
                               "403 Origin: is not",
                               "403 Origin: web pages",
                               "400 request: ",
                               "400 body: ",
                               "413 request: ",
                               "404 path: not found; the API",
                               "400 k0: ",
                               "405 method: "};
  for (const char* kind : kinds) EXPECT_EQ(count(log.text(), kind), 1U) << kind << log.text();
  EXPECT_EQ(count(log.text(), "refused"), std::size(kinds)) << log.text();
}

TEST_F(Hostile, LogsSlowSendersOnce) {
  const test::Log log;
  options_.timeouts.request = std::chrono::milliseconds(1);
  start();
  for (int n = 0; n < 5; ++n) {
    const Client one = client();
    one.send("GET /api/v1/sta");
    EXPECT_EQ(one.receive_all(), "");
  }
  stop();
  EXPECT_EQ(count(log.text(), "refused"), 1U) << log.text();
  EXPECT_EQ(count(log.text(), "request: took too long"), 1U) << log.text();
}

TEST_F(Hostile, LogsClientsThatDoNotReadOnce) {
  const test::Log log;
  options_.timeouts.request = std::chrono::milliseconds(250);
  start();
  // All requests arrive at once; their answers exceed the socket buffer many times.
  std::string requests;
  for (int n = 0; n < 100; ++n) requests += "GET /api/v1/faults/kinds HTTP/1.1\r\nHost: x\r\n\r\n";
  for (int n = 0; n < 2; ++n) {
    const Client sleeper = client();
    EXPECT_TRUE(sleeper.send(requests));
    while (sleeper.send(kStatus)) {
    }
  }
  stop();
  EXPECT_EQ(count(log.text(), "refused"), 1U) << log.text();
  EXPECT_EQ(count(log.text(), "answer: the client did not read"), 1U) << log.text();
}

TEST_F(Hostile, ClientTextNeitherFloodsNorMutesTheLog) {
  const test::Log log;
  listen_to_tcp();
  options_.token_file = token_file("correct-horse-battery", fs::perms::owner_read);
  start();
  for (int n = 0; n < 200; ++n) {
    const std::string key = "%0Ak" + std::to_string(n);
    ask_tcp("GET /api/v1/status?" + key + "=1&" + key + "=2 HTTP/1.1\r\nHost: " + host() +
            "\r\nAuthorization: Bearer correct-horse-battery\r\n\r\n");
  }
  ask_tcp("GET /api/v1/status HTTP/1.1\r\nHost: " + host() + "\r\n\r\n");
  stop();
  EXPECT_NE(log.text().find("400 ?k0: is given twice"), std::string::npos) << log.text();
  EXPECT_EQ(count(log.text(), "401 Authorization: "), 1U) << log.text();
  EXPECT_EQ(count(log.text(), "refused"), 2U) << log.text();
  EXPECT_EQ(count(log.text(), "\nk"), 0U) << "nor break its lines";
}

// --- WebSocket

TEST_F(Hostile, RejectsIncompleteHandshakes) {
  start();
  const std::string good = upgrade("signals=alive");
  for (const char* field : {"Host: x\r\n", "Sec-WebSocket-Version: 13\r\n",
                            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"}) {
    std::string request = good;
    request.erase(request.find(field), std::string(field).size());
    const std::string answer = ask(request);
    EXPECT_EQ(status(answer), 400) << field;
    EXPECT_NE(answer.find("{\"error\":"), std::string::npos) << answer;
  }
}

TEST_F(Hostile, ForbiddenFramesEndTheStream) {
  start();
  const std::string fragment = websocket_frame(0x01, std::string(1000, 'x'));
  const std::string more = websocket_frame(0x00, std::string(1000, 'x'));
  std::string endless = fragment;
  for (int n = 0; n < 100; ++n) endless += more;
  const std::string unmasked("\x81\x05hello", 7);
  const std::string huge("\x82\xFF\x40\0\0\0\0\0\0\0\0\0\0\0x", 15);
  for (const std::string& frames :
       {endless, unmasked, huge, websocket_frame(0x89, std::string(126, 'x')),
        websocket_frame(0x83, "reserved"), websocket_frame(0x80, "continues nothing"),
        websocket_frame(0xC1, "compressed")}) {
    const Client one = open(upgrade("signals=alive&rate_Hz=10"));
    one.send(frames);
    // The last bytes are a close frame with the reason: 1002, or 1009 for a frame that is too long.
    const std::string rest = one.receive_all();
    EXPECT_TRUE(rest.find("\x03\xEA") != std::string::npos ||
                rest.find("\x03\xF1") != std::string::npos)
        << testing::PrintToString(rest);
  }
  expect_others_served();
}

TEST_F(Hostile, SlowTelemetryReaderLosesSamplesOnly) {
  start();
  // 10 kHz of more than 200 bytes: 2 MB in a second, more than the server buffers.
  const Client sleeper =
      open(upgrade("signals=angle_deg,speed_dps,iq_A,voltage_V,true_angle_deg&rate_Hz=10000"));
  ASSERT_EQ(status(ask(post("/clock/advance", R"({"by_s": 1})"))), 200);
  ASSERT_EQ(status(ask(post("/clock/advance", R"({"by_s": 1})"))), 200);
  auto awake = std::async(std::launch::async, [&] { return sleeper.receive_until("\"lost\":"); });
  while (awake.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    ASSERT_EQ(status(ask(post("/clock/advance", R"({"by_s": 0.001})"))), 200);
  }
  EXPECT_TRUE(awake.get().ends_with("\"lost\":"));
}

}  // namespace hostile_test
}  // namespace lk::emulator
