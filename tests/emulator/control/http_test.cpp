// The control interface over real sockets: access control and malicious clients. No test waits for
// a fixed time, only for an answer or the end of the connection.

#include "emulator/core/start_error.hpp"
#include "emulator/files/runtime_dir.hpp"
#include "emulator/io/control/http_access.hpp"
#include "tests/emulator/control/http_support.hpp"
#include "tools/ctl/ctl_client.hpp"

namespace lk::emulator {
namespace http_test {

TEST_F(HttpServer, RestrictsTheSocketToTheUser) {
  start();
  EXPECT_EQ(fs::status(options_.socket).permissions(),
            fs::perms::owner_read | fs::perms::owner_write);
  stop();
  EXPECT_FALSE(fs::exists(options_.socket)) << "removed at the end";
}

TEST_F(HttpServer, ReplacesOnlyStaleSockets) {
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

TEST_F(HttpServer, KeepsSocketWhenTheProbeFails) {
  if (kAddressSanitizer) GTEST_SKIP() << "the sanitizer needs descriptors of its own";
  start();
  {
    const NoDescriptors none;
    EXPECT_THROW(clear_stale_socket(options_.socket), StartError);
  }
  EXPECT_EQ(status(ask(kStatus)), 200) << "it is where it was";
}

TEST_F(HttpServer, KeepsFilesAndLinksAtTheSocketPath) {
  std::ofstream(options_.socket) << "mine";
  EXPECT_THROW(ControlServer(t_.loop, t_.world, options_), StartError);
  EXPECT_EQ(fs::file_size(options_.socket), 4U);
  fs::remove(options_.socket);
  fs::create_symlink(directory_ / "elsewhere", options_.socket);
  EXPECT_THROW(ControlServer(t_.loop, t_.world, options_), StartError);
}

TEST_F(HttpServer, RejectsInsecureRuntimeDirectory) {
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

TEST_F(HttpServer, AnswersPipelinedRequestsInOrder) {
  start();
  const Client one = client();
  std::string many;
  for (int n = 0; n < 200; ++n) many += kStatus;
  one.send(many);
  for (int n = 0; n < 200; ++n) ASSERT_EQ(status(one.receive_answer()), 200) << n;
  one.send("\x01\x02 garbage\r\n\r\n");
  EXPECT_EQ(status(one.receive_all()), 400);
}

/// A stopped program behaves this way: its kernel accepts connections for it.
TEST_F(HttpServer, DiscoverySkipsUnresponsivePrograms) {
  const fs::path runtime = directory_ / "lk-emu";
  secure_directory(runtime);
  options_.socket = (runtime / "vcan0-2.sock").string();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string silent = (runtime / "vcan0-1.sock").string();
  std::copy(silent.begin(), silent.end(), std::begin(address.sun_path));
  const int listening = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  ASSERT_EQ(::bind(listening, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(::listen(listening, 5), 0);
  start();
  const char* const before = std::getenv("XDG_RUNTIME_DIR");
  const std::string kept = before != nullptr ? before : "";
  ::setenv("XDG_RUNTIME_DIR", directory_.c_str(), 1);
  EXPECT_NO_THROW(EXPECT_EQ(find_socket("", "vcan0"), options_.socket));
  EXPECT_THROW(find_socket("", "vcan9"), StartError);
  before != nullptr ? ::setenv("XDG_RUNTIME_DIR", kept.c_str(), 1) : ::unsetenv("XDG_RUNTIME_DIR");
  ::close(listening);
}

TEST_F(HttpServer, LimitsHeadersAndBodies) {
  start();
  EXPECT_EQ(status(ask("GET /api/v1/status HTTP/1.1\r\nX: " + std::string(9000, 'x') + "\r\n\r\n")),
            431);
  const auto announce = [](const std::string& path, std::size_t length) {
    return "POST /api/v1" + path + " HTTP/1.1\r\nContent-Type: application/json\r\n" +
           "Content-Length: " + std::to_string(length) + "\r\n\r\n";
  };
  EXPECT_EQ(status(ask(announce("/directives", 64 * 1024 + 1))), 413);
  EXPECT_EQ(status(ask(announce("/scenario", 64 * 1024 + 1))), 413);
  EXPECT_EQ(status(ask(announce("/scenario", 60'000) + R"({"toml":")" + std::string(59'989, ' ') +
                       "\"}")),
            501);
  // An endless body.
  const Client endless = client();
  endless.send("POST /api/v1/directives HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n");
  const std::string chunk = "4000\r\n" + std::string(0x4000, 'x') + "\r\n";
  for (int n = 0; n < 8; ++n) endless.send(chunk);
  EXPECT_EQ(status(endless.receive_all()), 413);
}

TEST_F(HttpServer, CancelsAdvanceWhenTheClientDisconnects) {
  start();
  const auto advancing = [&](const char* whether) {
    return ask("GET /api/v1/clock HTTP/1.1\r\n\r\n")
               .find(std::string("\"advancing\":") + whether) != std::string::npos;
  };
  // Data sent ahead: part of the next request, or whole ones, in one or more pieces.
  for (const std::string& ahead : {std::string(), std::string("G"), kStatus + kStatus}) {
    {
      const Client one = client();
      one.send(post("/clock/advance", R"({"by_s": 36000})") + ahead);
      while (!advancing("true")) {
      }
      one.send(ahead);
    }
    while (advancing("true")) {
    }
    EXPECT_TRUE(advancing("false"));
  }
}

TEST_F(HttpServer, AnswersPipelinedRequestsAfterAnAdvance) {
  start();
  const Client one = client();
  one.send(post("/clock/advance", R"({"by_s": 36000})"));
  while (ask("GET /api/v1/clock HTTP/1.1\r\n\r\n").find("\"advancing\":true") ==
         std::string::npos) {
  }
  one.send(kStatus + kStatus.substr(0, 9));
  one.send(kStatus.substr(9));
  EXPECT_EQ(status(ask("DELETE /api/v1/clock/advance HTTP/1.1\r\n\r\n")), 200);
  EXPECT_EQ(status(one.receive_answer()), 409) << "the advance, cancelled";
  EXPECT_EQ(status(one.receive_answer()), 200);
  EXPECT_EQ(status(one.receive_answer()), 200);
}

TEST_F(HttpServer, RejectsForeignPagesOverTcp) {
  options_.http = HttpAddress{"127.0.0.1", 0};
  start();
  const auto with = [&](const std::string& name, const std::string& more) {
    return get_tcp("Host: " + name + "\r\n" + more);
  };
  EXPECT_EQ(with(host(), ""), 200);
  EXPECT_EQ(with(host(), "Origin: http://" + host() + "\r\n"), 200);
  EXPECT_EQ(with(host(), "Origin: http://example.com\r\n"), 403);
  EXPECT_EQ(with(host(), "Origin: null\r\n"), 403);
  EXPECT_EQ(with("example.com:" + std::to_string(server_->port()), ""), 403);
  for (const char* name : {"localhost", "LOCALHOST", "LocalHost:1", "127.0.0.1:8474",
                           "192.0.2.1:8474", "[::1]", "[::1]:8474"}) {
    EXPECT_EQ(with(name, ""), 200) << name << ": a tunnel may show another address or port";
    EXPECT_EQ(with(name, "Origin: http://" + std::string(name) + "\r\n"), 200) << name;
    EXPECT_EQ(with(name, "Origin: http://localhost:3000\r\n"), 403) << "another program's page";
  }
  for (const char* name : {"", ":80", "127.0.0.1.example.com", "localhost:x", "[::1", "::1",
                           "[localhost]:80", "[127.0.0.1]:80", "[::1]8474", "127.0.0.1:80:80"}) {
    EXPECT_EQ(with(name, ""), 403) << name;
  }
  const std::string foreign = "Host: " + host() + "\r\nOrigin: http://example.com\r\n";
  EXPECT_EQ(status(ask_tcp(upgrade_at("/status", foreign))), 403);
}

TEST_F(HttpServer, HostInTheTargetOverridesTheHeader) {
  options_.http = HttpAddress{"127.0.0.1", 0};
  start();
  const auto get = [&](const std::string& target, const std::string& host) {
    return status(ask_tcp("GET " + target + " HTTP/1.1\r\nHost: " + host + "\r\n\r\n"));
  };
  const std::string here = "http://" + host();
  EXPECT_EQ(get(here + "/api/v1/status", host()), 200);
  EXPECT_EQ(get("HTTP://LOCALHOST/api/v1/clock", "example.com"), 200);
  EXPECT_EQ(get(here, host()), 200) << "the dashboard";
  EXPECT_EQ(get("http://example.com/api/v1/status", host()), 403);
  EXPECT_EQ(get("http://a@localhost/api/v1/status", host()), 403);
}

TEST_F(HttpServer, AnswersOnAnyLoopbackAddress) {
  options_.http = HttpAddress{"127.0.0.2", 0};
  start();
  const std::string port = ":" + std::to_string(server_->port());
  for (const std::string& name : {"127.0.0.2" + port, "localhost" + port}) {
    const Client one = Client::tcp(server_->port(), "127.0.0.2");
    one.send("GET / HTTP/1.1\r\nHost: " + name + "\r\nOrigin: http://" + name + "\r\n\r\n");
    EXPECT_EQ(status(one.receive_answer()), 200) << name;
  }
}

TEST_F(HttpServer, OpenToOthersIsExplicitAndRejectsForeignPages) {
  options_.http = HttpAddress{"0.0.0.0", 0};
  EXPECT_THROW(start(), StartError);
  options_.open_to_others = true;
  start();
  const auto with = [&](const std::string& name, const std::string& more) {
    return get_tcp("Host: " + name + "\r\n" + more);
  };
  EXPECT_EQ(with("192.0.2.1:8474", ""), 200);
  EXPECT_EQ(with("192.0.2.1:8474", "Origin: http://192.0.2.1:8474\r\n"), 200);
  EXPECT_EQ(with("192.0.2.1:8474", "Origin: http://example.com\r\n"), 403);
  EXPECT_EQ(with("example.com:8474", "Origin: http://example.com:8474\r\n"), 403);
}

TEST_F(HttpServer, AllowsReadsOnlyWithoutAToken) {
  options_.http = HttpAddress{"0.0.0.0", 0};
  options_.open_to_others = true;
  for (const bool may : {false, true}) {
    options_.pages_may_write = may;
    start();
    EXPECT_EQ(send_tcp("GET /api/v1/drives", ""), 200);
    EXPECT_EQ(send_tcp("POST /api/v1/directives", R"({"power": "off"})"), may ? 200 : 403);
    EXPECT_EQ(send_tcp("DELETE /api/v1/directives", ""), may ? 200 : 403);
    server_->api().recording.start = [](TableReader&, bool) { return Json::object(); };
    EXPECT_EQ(send_tcp("POST /api/v1/recording", R"({"directory": "x"})"), 403)
        << "it writes files";
    EXPECT_EQ(status(ask(post("/directives", R"({"power": "off"})"))), 200) << "the Unix socket";
    stop_and_reset();
  }
}

TEST_F(HttpServer, AllowsRecordingWithAToken) {
  const std::string token = "correct-horse-battery";
  for (const bool asked_for : {false, true}) {
    options_.http = HttpAddress{"127.0.0.1", 0};
    if (asked_for) options_.token_file = token_file(token, fs::perms::owner_read);
    start();
    server_->api().recording.start = [](TableReader&, bool) { return Json::object(); };
    const int answer = send_tcp("POST /api/v1/recording", R"({"directory": "x"})",
                                "Authorization: Bearer " + token + "\r\n");
    EXPECT_EQ(answer, asked_for ? 200 : 403) << "a header that nobody looks at is no token";
    stop_and_reset();
  }
}

TEST_F(HttpServer, RequiresTheConfiguredToken) {
  const std::string token = "correct-horse-battery";
  options_.http = HttpAddress{"127.0.0.1", 0};
  options_.token_file = token_file(token, fs::perms::owner_read);
  start();
  const auto with = [&](const std::string& more) {
    return get_tcp("Host: " + host() + "\r\n" + more);
  };
  EXPECT_EQ(with(""), 401);
  EXPECT_EQ(with("Authorization: Bearer " + token + "\r\n"), 200);
  EXPECT_EQ(with("Authorization: Bearer " + token + "x\r\n"), 401);
  EXPECT_EQ(with("Authorization: Bearer correct-horse-batterz\r\n"), 401);
  EXPECT_EQ(with("Authorization: Bearer \r\n"), 401);
  EXPECT_EQ(with("Authorization: Basic " + token + "\r\n"), 401);
}

TEST_F(HttpServer, NeverTruncatesTokens) {
  options_.http = HttpAddress{"127.0.0.1", 0};
  const std::string longest(2048, 'x');
  const auto mode = fs::perms::owner_read | fs::perms::owner_write;
  options_.token_file = token_file(longest + "y", mode);
  EXPECT_THROW(ControlServer(t_.loop, t_.world, options_), StartError);
  options_.token_file = token_file(longest + std::string(4096, 'y'), mode);
  EXPECT_THROW(ControlServer(t_.loop, t_.world, options_), StartError);
  options_.token_file = token_file(longest + "\r", mode);  // plus a line end
  start();
  const auto with = [&](const std::string& token) {
    return get_tcp("Host: " + host() + "\r\nAuthorization: Bearer " + token + "\r\n");
  };
  EXPECT_EQ(with(longest), 200);
  EXPECT_EQ(with(longest.substr(1)), 401);
  // A page encodes each byte as two digits, in one header.
  std::string digits;
  for (std::size_t n = 0; n < longest.size(); ++n) digits += "78";
  const Client page = Client::tcp(server_->port());
  page.send(upgrade_at(
      "/telemetry?signals=alive",
      "Host: " + host() + "\r\nSec-WebSocket-Protocol: lk-emu, bearer." + digits + "\r\n"));
  EXPECT_EQ(status(page.receive_until("\r\n\r\n")), 101);
}

TEST_F(HttpServer, OpenAddressRequiresASecretToken) {
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

TEST_F(HttpServer, TelemetryCoversEverySampleInstant) {
  start();
  const Client stream = open(upgrade("signals=alive&ids=2&rate_Hz=1000"));
  EXPECT_NE(stream.receive_until("}").find(R"({"bus":"vcan0","ids":[2],"signals":["alive"])"),
            std::string::npos);
  EXPECT_EQ(status(ask(post("/clock/advance", R"({"by_s": 0.003})"))), 200);
  // A frame is a length byte and its text, 1 ms apart from the start.
  for (const char* time : {"0", "0.001", "0.002", "0.003"}) {
    const std::string sample = stream.receive_until("}");
    EXPECT_NE(sample.find(std::string("{\"time_s\":") + time + ",\"rows\":[[2,"), std::string::npos)
        << sample;
  }
}

TEST_F(HttpServer, TelemetryHasTheWantedDigits) {
  start();
  ASSERT_EQ(status(ask(post("/clock/advance", R"({"by_s": 0.1})"))), 200);
  const Client stream = open(upgrade("signals=voltage_V&ids=2&rate_Hz=1000&digits=3"));
  stream.receive_until("}");
  ASSERT_EQ(status(ask(post("/clock/advance", R"({"by_s": 0.001})"))), 200);
  const std::string sample = stream.receive_until("}");
  const std::size_t value = sample.find("[[2,") + 4;
  EXPECT_LE(sample.find("]]") - value, std::string_view("24.1").size()) << sample;
}

}  // namespace http_test
}  // namespace lk::emulator
